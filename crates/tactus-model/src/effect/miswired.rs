//! `miswired`: an element is dead, or reports another element's signal.
//!
//! ```text
//! u_element -> own_share u_element + other_share u_answers_for
//! ```
//!
//! | parameter | unit | neutral | range | meaning |
//! |---|---|---|---|---|
//! | `element` | index | 0 | an element of the array | the faulty element |
//! | `answers_for` | index | 0 | an element of the array | the element whose signal it takes |
//! | `own_share` | - | 1 | 0 to 1 | share of its own signal that it keeps |
//! | `other_share` | - | 0 | -1 to 1 | share of the other element's signal that it takes |
//!
//! A dead element has both shares at 0. The paper's faulty elements have an `own_share` of 0 and an `other_share` of 1. Each
//! faulty element takes an effect of its own. All of them take the signals before any such effect, so that their order does
//! not matter. The element keeps its own gain and baseline.
//!
//! # Source
//! The paper's Sec. 2.2: two elements responded to a stimulus of one adjacent element, but not to their own.

use super::{Definition, Make, Now, OnElement, Parameter};

pub(super) static DEFINITION: Definition = Definition {
    name: "miswired",
    summary: "an element is dead, or answers for another",
    parameters: &[
        Parameter::element("element"),
        Parameter::element("answers_for"),
        Parameter::real("own_share", 1.0, [0.0, 1.0]),
        Parameter::real("other_share", 0.0, [-1.0, 1.0]),
    ],
    near_twins: &["crosstalk", "sensitivity_counts_per_mm"],
    acts_by: &[],
    shown_by: &["element-centres"],
    curve: None,
    make: Make::Element(|values| {
        Box::new(Miswired {
            element: index(values[0]),
            answers_for: index(values[1]),
            own_share: values[2],
            other_share: values[3],
        })
    }),
};

#[derive(Debug)]
struct Miswired {
    element: usize,
    answers_for: usize,
    own_share: f64,
    other_share: f64,
}

impl OnElement for Miswired {
    fn signal(&mut self, _: Now<'_>, input_mm: &[f64], signal_mm: &mut [f64]) {
        if let (Some(u), Some(other)) = (signal_mm.get_mut(self.element), input_mm.get(self.answers_for)) {
            *u = self.own_share * *u + self.other_share * other;
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an index, checked against the array"
)]
fn index(value: f64) -> usize {
    value as usize
}

#[cfg(test)]
#[path = "miswired_tests.rs"]
mod tests;
