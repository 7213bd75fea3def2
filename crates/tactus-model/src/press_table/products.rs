//! Sums of products, by the instructions that the processor at hand has.

#![expect(clippy::inline_always, reason = "instructions are those of the function that a call ends up in")]

use pulp::NullaryFnOnce;
use wide::f32x4;

/// A way to add products of four numbers each.
pub(super) trait Products: Copy {
    /// `sum + a * b`.
    fn add(self, sum: f32x4, a: f32x4, b: f32x4) -> f32x4;
}

/// Work that adds products. All functions that it calls must be inlined, or they do without the instructions.
pub(super) trait Work {
    /// Does the work.
    fn by(self, products: impl Products);
}

/// Does the work by the best way of this processor.
pub(super) fn on_this_processor(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    if let Some(fused) = pulp::x86::V3::try_new() {
        return fused.vectorize(With { products: fused, work });
    }
    work.by(Apart);
}

/// A product is rounded before it is added: any processor.
#[derive(Clone, Copy)]
pub(super) struct Apart;

impl Products for Apart {
    #[inline(always)]
    fn add(self, sum: f32x4, a: f32x4, b: f32x4) -> f32x4 {
        sum + a * b
    }
}

/// Product and sum are one instruction, and rounded once: x86-64 processors since 2013.
#[cfg(target_arch = "x86_64")]
impl Products for pulp::x86::V3 {
    #[inline(always)]
    fn add(self, sum: f32x4, a: f32x4, b: f32x4) -> f32x4 {
        let [sum, a, b]: [pulp::f32x4; 3] = [sum, a, b].map(pulp::cast);
        pulp::cast(self.mul_add_f32x4(a, b, sum))
    }
}

struct With<P, W> {
    products: P,
    work: W,
}

impl<P: Products, W: Work> NullaryFnOnce for With<P, W> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.work.by(self.products);
    }
}
