//! Motion along a straight line: accelerate evenly, cruise, brake evenly to rest.

/// Distance against time from a start speed to rest, by constant acceleration, cruise and braking.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Profile {
    distance_mm: f64,
    start_mm_per_s: f64,
    peak_mm_per_s: f64,
    acceleration_mm_per_s2: f64,
}

impl Profile {
    /// Over `distance_mm` at no more than `top_mm_per_s` (more only while braking from a faster start).
    ///
    /// The distance must suffice to brake from the start speed, `v^2 / 2a`; a shorter one is braked faster.
    pub(crate) fn new(
        distance_mm: f64,
        start_mm_per_s: f64,
        top_mm_per_s: f64,
        acceleration_mm_per_s2: f64,
    ) -> Self {
        let braking_mm = start_mm_per_s * start_mm_per_s / (2.0 * acceleration_mm_per_s2);
        if distance_mm <= braking_mm {
            let acceleration_mm_per_s2 = if distance_mm > 0.0 {
                start_mm_per_s * start_mm_per_s / (2.0 * distance_mm)
            } else {
                acceleration_mm_per_s2
            };
            let start_mm_per_s = if distance_mm > 0.0 { start_mm_per_s } else { 0.0 };
            return Self {
                distance_mm,
                start_mm_per_s,
                peak_mm_per_s: start_mm_per_s,
                acceleration_mm_per_s2,
            };
        }
        // Up to the peak and down again over the whole distance: 2 v^2 = v0^2 + 2 a d.
        let triangle = (acceleration_mm_per_s2 * (distance_mm + braking_mm)).sqrt();
        let peak_mm_per_s = top_mm_per_s.max(start_mm_per_s).min(triangle);
        Self { distance_mm, start_mm_per_s, peak_mm_per_s, acceleration_mm_per_s2 }
    }

    /// Braking to rest as fast as it can.
    pub(crate) fn brake(start_mm_per_s: f64, acceleration_mm_per_s2: f64) -> Self {
        let distance_mm = start_mm_per_s * start_mm_per_s / (2.0 * acceleration_mm_per_s2);
        Self::new(distance_mm, start_mm_per_s, start_mm_per_s, acceleration_mm_per_s2)
    }

    /// Total distance.
    pub(crate) fn distance_mm(&self) -> f64 {
        self.distance_mm
    }

    /// Time to rest.
    pub(crate) fn duration_s(&self) -> f64 {
        self.cruise_until_s() + self.peak_mm_per_s / self.acceleration_mm_per_s2
    }

    /// Distance after `t_s`; the total at and after the end.
    pub(crate) fn distance_at(&self, t_s: f64) -> f64 {
        let (v0, v, a) = (self.start_mm_per_s, self.peak_mm_per_s, self.acceleration_mm_per_s2);
        let speeding_up_s = self.speeding_up_s();
        if t_s <= 0.0 {
            0.0
        } else if t_s < speeding_up_s {
            v0 * t_s + 0.5 * a * t_s * t_s
        } else if t_s < self.cruise_until_s() {
            self.speeding_up_mm() + v * (t_s - speeding_up_s)
        } else {
            let left_s = (self.duration_s() - t_s).max(0.0);
            self.distance_mm - 0.5 * a * left_s * left_s
        }
    }

    /// Speed after `t_s`; 0 at and after the end.
    pub(crate) fn speed_at(&self, t_s: f64) -> f64 {
        let (v0, v, a) = (self.start_mm_per_s, self.peak_mm_per_s, self.acceleration_mm_per_s2);
        if t_s < self.speeding_up_s() {
            v0 + a * t_s.max(0.0)
        } else if t_s < self.cruise_until_s() {
            v
        } else {
            a * (self.duration_s() - t_s).max(0.0)
        }
    }

    /// When `gone_mm` of the distance are covered; the end for the total and more.
    pub(crate) fn time_at(&self, gone_mm: f64) -> f64 {
        let (v0, v, a) = (self.start_mm_per_s, self.peak_mm_per_s, self.acceleration_mm_per_s2);
        let left_mm = self.distance_mm - gone_mm;
        if gone_mm <= 0.0 {
            0.0
        } else if gone_mm < self.speeding_up_mm() {
            ((v0 * v0 + 2.0 * a * gone_mm).sqrt() - v0) / a
        } else if left_mm > v * v / (2.0 * a) {
            self.speeding_up_s() + (gone_mm - self.speeding_up_mm()) / v
        } else {
            self.duration_s() - (2.0 * left_mm.max(0.0) / a).sqrt()
        }
    }

    fn speeding_up_s(&self) -> f64 {
        (self.peak_mm_per_s - self.start_mm_per_s) / self.acceleration_mm_per_s2
    }

    fn speeding_up_mm(&self) -> f64 {
        0.5 * (self.peak_mm_per_s + self.start_mm_per_s) * self.speeding_up_s()
    }

    fn cruise_until_s(&self) -> f64 {
        let braking_mm = self.peak_mm_per_s * self.peak_mm_per_s / (2.0 * self.acceleration_mm_per_s2);
        let cruise_mm = (self.distance_mm - self.speeding_up_mm() - braking_mm).max(0.0);
        self.speeding_up_s() + if cruise_mm > 0.0 { cruise_mm / self.peak_mm_per_s } else { 0.0 }
    }
}

#[cfg(test)]
#[path = "kinematics_tests.rs"]
mod tests;
