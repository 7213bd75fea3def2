//! A disc's even pressure as forces on nodes.

use std::f64::consts::PI;

use libm::{asin, cos, sin, sqrt};

use crate::quadrature::integrate;

/// The force on a node by 1 N spread evenly over a disc about the middle, by the node's bilinear shape function;
/// lengths in bricks. Accurate to about 1e-12.
pub(super) fn force_of_disc(radius: f64, [x, y]: [f64; 2]) -> f64 {
    if x.hypot(y) > radius + sqrt(2.0) {
        return 0.0;
    }
    // Along y in closed form, along x = radius sin(turn) by quadrature between all kinks of the integrand.
    let ahead = |from: f64| {
        let from = from.clamp(-1.0, 1.0);
        0.5 - from + from * from.abs() / 2.0
    };
    let force = |turn: f64| {
        let (at, reach) = (radius * sin(turn), radius * cos(turn));
        let share = (1.0 - (at - x).abs()).max(0.0);
        share * (ahead(-reach - y) - ahead(reach - y)) * reach
    };
    let turn = |at: f64| asin((at / radius).clamp(-1.0, 1.0));
    let ends = [x - 1.0, x + 1.0].map(turn);
    let of_x = [ends[0], turn(x), ends[1]].into_iter();
    let of_y =
        [y - 1.0, y, y + 1.0].into_iter().map(|at| PI / 2.0 - turn(at.abs())).flat_map(|turn| [-turn, turn]);
    let mut kinks: Vec<f64> = of_x.chain(of_y).filter(|turn| (ends[0]..=ends[1]).contains(turn)).collect();
    kinks.sort_by(f64::total_cmp);
    let panels = kinks.windows(2).map(|ends| integrate([ends[0], ends[1]], PI, force));
    panels.sum::<f64>() / (PI * radius * radius)
}
