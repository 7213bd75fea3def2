//! True and believed position of the stage's tip as functions of time.

use std::collections::VecDeque;
use std::time::Duration;

use tokio::time::Instant;

use crate::kinematics::Profile;

/// x, y, z in mm, robot frame.
pub(crate) type Point = [f64; 3];

/// A queue of straight moves, each from rest to rest, without pauses between them.
///
/// The believed position follows from the moves alone. The true position differs from it by an offset: an arbitrary one before
/// homing, and the lost steps since.
#[derive(Debug)]
pub(crate) struct Motion {
    acceleration_mm_per_s2: f64,
    rest_mm: Point,
    offset_mm: Point,
    moves: VecDeque<Move>,
    held: VecDeque<MoveTarget>,
    lose_next_mm: f64,
}

#[derive(Debug, Clone, Copy)]
struct MoveTarget {
    to_mm: Point,
    speed_mm_per_s: f64,
}

#[derive(Debug, Clone, Copy)]
struct Move {
    from_mm: Point,
    direction: Point,
    target: MoveTarget,
    profile: Profile,
    start: Instant,
    /// Distance over which the motor slips at the beginning.
    lost_mm: f64,
}

impl Motion {
    /// At rest at `true_mm`, believed to be at `believed_mm`.
    pub(crate) fn at_rest(believed_mm: Point, true_mm: Point, acceleration_mm_per_s2: f64) -> Self {
        Self {
            acceleration_mm_per_s2,
            rest_mm: believed_mm,
            offset_mm: difference(true_mm, believed_mm),
            moves: VecDeque::new(),
            held: VecDeque::new(),
            lose_next_mm: 0.0,
        }
    }

    /// Sets the acceleration from the next move on.
    pub(crate) fn set_acceleration(&mut self, acceleration_mm_per_s2: f64) {
        self.acceleration_mm_per_s2 = acceleration_mm_per_s2;
    }

    /// Believed position at `at`, which is not before the last change.
    pub(crate) fn believed_mm(&self, at: Instant) -> Point {
        self.current(at).map_or(self.rest_mm, |current| current.position_mm(at))
    }

    /// True position at `at`, which is not before the last change.
    pub(crate) fn true_mm(&self, at: Instant) -> Point {
        let mut true_mm = sum(self.believed_mm(at), self.offset_mm);
        for one in self.moves.iter().take_while(|one| one.start <= at) {
            true_mm = difference(true_mm, one.slipped_mm(at));
        }
        true_mm
    }

    /// True position at the end of each move, in order.
    pub(crate) fn true_ends_mm(&self) -> impl Iterator<Item = (Instant, Point)> {
        self.moves.iter().map(|one| (one.end(), self.true_mm(one.end())))
    }

    /// Speed along the path.
    pub(crate) fn speed_mm_per_s(&self, at: Instant) -> f64 {
        self.current(at).map_or(0.0, |current| current.profile.speed_at(current.elapsed_s(at)))
    }

    /// Believed position at the end of the last move, held ones included.
    pub(crate) fn destination_mm(&self) -> Point {
        let held = self.held.back().map(|target| target.to_mm);
        held.or(self.moves.back().map(Move::end_mm)).unwrap_or(self.rest_mm)
    }

    /// Number of moves, started or waiting.
    pub(crate) fn pending(&self) -> usize {
        self.moves.len() + self.held.len()
    }

    /// True while the tip moves.
    pub(crate) fn is_moving(&self) -> bool {
        !self.moves.is_empty()
    }

    /// When the present move ends.
    pub(crate) fn next_end(&self) -> Option<Instant> {
        self.moves.front().map(Move::end)
    }

    /// When the last move ends, without held ones.
    pub(crate) fn last_end(&self) -> Option<Instant> {
        self.moves.back().map(Move::end)
    }

    /// When the tip first leaves `travel_mm` (least and greatest of each axis), without held moves.
    pub(crate) fn leaves(&self, travel_mm: [[f64; 2]; 3]) -> Option<Instant> {
        let mut offset_mm = self.offset_mm;
        self.moves.iter().find_map(|one| {
            let way_mm = one.profile.distance_mm();
            let true_from_mm = sum(one.from_mm, offset_mm);
            // The slip delays the tip at the start; after it the path is straight.
            let slip_mm = one.lost_mm.min(way_mm);
            offset_mm = difference(offset_mm, one.direction.map(|part| part * slip_mm));
            let leaves_mm = (0..3)
                .filter_map(|axis| {
                    let direction = one.direction[axis];
                    let [least, greatest] = travel_mm[axis];
                    let edge_mm = if direction > 0.0 { greatest } else { least };
                    (direction != 0.0).then(|| (edge_mm - true_from_mm[axis]) / direction + slip_mm)
                })
                .fold(f64::INFINITY, f64::min);
            (leaves_mm < way_mm - 1e-9).then(|| one.start + seconds(one.profile.time_at(leaves_mm.max(0.0))))
        })
    }

    /// Removes finished moves.
    pub(crate) fn settle(&mut self, now: Instant) {
        while let Some(done) = self.moves.pop_front_if(|one| one.end() <= now) {
            self.retire(&done, now);
        }
    }

    /// Appends a move. It does not resume held motion: the move waits too.
    pub(crate) fn push(&mut self, to_mm: Point, speed_mm_per_s: f64, now: Instant) {
        let target = MoveTarget { to_mm, speed_mm_per_s };
        if self.held.is_empty() {
            self.start(target, now);
        } else {
            self.held.push_back(target);
        }
    }

    /// Appends a move to a true position, as homing switches define it.
    pub(crate) fn push_true(&mut self, true_mm: Point, speed_mm_per_s: f64, now: Instant) {
        self.push(difference(true_mm, self.offset_mm), speed_mm_per_s, now);
    }

    /// Brakes at once and holds the rest of the moves.
    pub(crate) fn hold(&mut self, now: Instant) {
        self.settle(now);
        let mut undone: VecDeque<MoveTarget> = self.moves.iter().map(|one| one.target).collect();
        let Some(current) = self.moves.front().copied().filter(|current| current.start <= now) else {
            self.moves.clear();
            self.held.extend(undone);
            return;
        };
        let speed_mm_per_s = current.profile.speed_at(current.elapsed_s(now));
        let gone_mm = current.profile.distance_at(current.elapsed_s(now));
        let braking = Profile::brake(speed_mm_per_s, self.acceleration_mm_per_s2);
        let left_mm = current.profile.distance_mm() - gone_mm;
        if braking.distance_mm() + 1e-9 >= left_mm {
            // It is already braking for its own end.
            undone.pop_front();
            self.moves.truncate(1);
        } else {
            self.retire(&current, now);
            let from_mm = self.rest_mm;
            let end_mm = along(from_mm, current.direction, braking.distance_mm());
            self.moves.clear();
            self.moves.push_back(Move {
                from_mm,
                target: MoveTarget { to_mm: end_mm, ..current.target },
                profile: braking,
                start: now,
                lost_mm: (current.lost_mm - gone_mm).max(0.0),
                ..current
            });
        }
        self.held.extend(undone);
    }

    /// Continues the held moves.
    pub(crate) fn resume(&mut self, now: Instant) {
        for target in std::mem::take(&mut self.held) {
            self.start(target, now);
        }
    }

    /// Discards the held moves.
    pub(crate) fn forget_held(&mut self) {
        self.held.clear();
    }

    /// Stops at once and discards all moves, as when the motors lose their current.
    pub(crate) fn freeze(&mut self, now: Instant) {
        self.settle(now);
        if let Some(current) = self.current(now).copied() {
            self.retire(&current, now);
        }
        self.moves.clear();
        self.held.clear();
    }

    /// Sets the believed position of a motion at rest.
    pub(crate) fn believe(&mut self, believed_mm: Point) {
        let true_mm = sum(self.rest_mm, self.offset_mm);
        self.rest_mm = believed_mm;
        self.offset_mm = difference(true_mm, believed_mm);
    }

    /// Lets the next move lose `lost_mm` of its distance.
    pub(crate) fn lose_steps(&mut self, lost_mm: f64) {
        self.lose_next_mm = lost_mm;
    }

    fn start(&mut self, target: MoveTarget, now: Instant) {
        let from_mm = self.moves.back().map_or(self.rest_mm, Move::end_mm);
        let start = self.moves.back().map_or(now, Move::end).max(now);
        let way = difference(target.to_mm, from_mm);
        let distance_mm = way.iter().map(|part| part * part).sum::<f64>().sqrt();
        if distance_mm == 0.0 {
            return;
        }
        self.moves.push_back(Move {
            from_mm,
            direction: way.map(|part| part / distance_mm),
            target,
            profile: Profile::new(distance_mm, 0.0, target.speed_mm_per_s, self.acceleration_mm_per_s2),
            start,
            lost_mm: std::mem::take(&mut self.lose_next_mm),
        });
    }

    /// Sets the rest position to that of `one`, and keeps its lost steps in the offset.
    fn retire(&mut self, one: &Move, now: Instant) {
        self.rest_mm = one.position_mm(now);
        self.offset_mm = difference(self.offset_mm, one.slipped_mm(now));
    }

    fn current(&self, at: Instant) -> Option<&Move> {
        self.moves.iter().rev().find(|one| one.start <= at)
    }
}

impl Move {
    fn elapsed_s(&self, at: Instant) -> f64 {
        at.saturating_duration_since(self.start).as_secs_f64()
    }

    fn end(&self) -> Instant {
        self.start + seconds(self.profile.duration_s())
    }

    fn end_mm(&self) -> Point {
        self.target.to_mm
    }

    fn position_mm(&self, at: Instant) -> Point {
        if at >= self.end() {
            return self.end_mm();
        }
        along(self.from_mm, self.direction, self.profile.distance_at(self.elapsed_s(at)))
    }

    fn slipped_mm(&self, at: Instant) -> Point {
        let slipped_mm = self.profile.distance_at(self.elapsed_s(at)).min(self.lost_mm);
        self.direction.map(|part| part * slipped_mm)
    }
}

fn sum(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] + b[axis])
}

fn difference(a: Point, b: Point) -> Point {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn along(from_mm: Point, direction: Point, distance_mm: f64) -> Point {
    std::array::from_fn(|axis| from_mm[axis] + direction[axis] * distance_mm)
}

/// Rounded up to a whole nanosecond, so that a motion has ended at its end time; at most some months.
fn seconds(duration_s: f64) -> Duration {
    let bounded_s = if duration_s > 0.0 { duration_s.min(1e7) } else { 0.0 };
    Duration::from_secs_f64(bounded_s) + Duration::from_nanos(1)
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;
