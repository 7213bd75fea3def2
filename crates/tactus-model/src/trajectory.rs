//! The path of the tip in time.

/// A path that is straight between points. Each point has a time in s and a position in mm (robot frame, z up).
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    times_s: Vec<f64>,
    positions_mm: Vec<[f64; 3]>,
}

/// Position of the tip at any instant: the input of the [`Pipeline`](crate::Pipeline).
///
/// A position alone is the path of a tip that rests there.
pub trait Path {
    /// Position at `t_s`, in mm, robot frame.
    fn at(&self, t_s: f64) -> [f64; 3];
}

/// Why points do not make a trajectory.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum TrajectoryError {
    /// There is no point.
    #[error("a trajectory needs at least one point")]
    Empty,
    /// A time or coordinate is not a finite number.
    #[error("point {index} is not finite: t = {t_s} s, position = {position_mm:?} mm")]
    NotFinite { index: usize, t_s: f64, position_mm: [f64; 3] },
    /// A time is not greater than the one before it.
    #[error("times must rise: point {index} is at {t_s} s, after one at {before_s} s")]
    Order { index: usize, t_s: f64, before_s: f64 },
}

impl Trajectory {
    /// A trajectory through points, each a time in s and a position in mm.
    ///
    /// # Errors
    /// [`TrajectoryError`] names the point that is wrong.
    pub fn new(points: impl IntoIterator<Item = (f64, [f64; 3])>) -> Result<Self, TrajectoryError> {
        let (times_s, positions_mm): (Vec<f64>, Vec<[f64; 3]>) = points.into_iter().unzip();
        if times_s.is_empty() {
            return Err(TrajectoryError::Empty);
        }
        for (index, (&t_s, &position_mm)) in times_s.iter().zip(&positions_mm).enumerate() {
            if !(t_s.is_finite() && position_mm.iter().all(|c| c.is_finite())) {
                return Err(TrajectoryError::NotFinite { index, t_s, position_mm });
            }
        }
        for (before, pair) in times_s.windows(2).enumerate() {
            if let [before_s, t_s] = *pair
                && t_s <= before_s
            {
                return Err(TrajectoryError::Order { index: before + 1, t_s, before_s });
            }
        }
        Ok(Self { times_s, positions_mm })
    }

    /// Position at `t_s`, in mm; the tip rests before the first point and after the last.
    pub fn at(&self, t_s: f64) -> [f64; 3] {
        let before = self.points_until(t_s).saturating_sub(1);
        let from = self.positions_mm[before];
        match self.positions_mm.get(before + 1) {
            Some(to) if t_s > self.times_s[before] => {
                let share = (t_s - self.times_s[before]) / (self.times_s[before + 1] - self.times_s[before]);
                std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis]))
            }
            _ => from,
        }
    }

    /// Velocity at `t_s`, in mm/s; at a point, that of the segment which begins there; 0 outside.
    pub fn velocity_mm_per_s(&self, t_s: f64) -> [f64; 3] {
        let after = self.points_until(t_s);
        if after == 0 || after == self.times_s.len() {
            return [0.0; 3];
        }
        let (from, to) = (self.positions_mm[after - 1], self.positions_mm[after]);
        let duration_s = self.times_s[after] - self.times_s[after - 1];
        std::array::from_fn(|axis| (to[axis] - from[axis]) / duration_s)
    }

    /// Time of the first point.
    pub fn start_s(&self) -> f64 {
        self.times_s[0]
    }

    /// Time of the last point.
    pub fn end_s(&self) -> f64 {
        self.times_s[self.times_s.len() - 1]
    }

    /// Number of points at or before `t_s`.
    fn points_until(&self, t_s: f64) -> usize {
        self.times_s.partition_point(|point_s| *point_s <= t_s)
    }
}

impl Path for Trajectory {
    fn at(&self, t_s: f64) -> [f64; 3] {
        self.at(t_s)
    }
}

impl Path for [f64; 3] {
    fn at(&self, _: f64) -> [f64; 3] {
        *self
    }
}

impl<F: Fn(f64) -> [f64; 3]> Path for F {
    fn at(&self, t_s: f64) -> [f64; 3] {
        self(t_s)
    }
}

#[cfg(test)]
#[path = "trajectory_tests.rs"]
mod tests;
