//! Estimates the device's clock relative to the host's.
//!
//! A frame is sampled at device time `tick * tick_ns` and reaches the host at `t_mono = sampling + delay`. The delay
//! is never negative and varies; many frames come close to its least value. So the line under all points
//! `(tick * tick_ns, t_mono - tick * tick_ns)` is the host's time of sampling, late by the least delay, which the host
//! cannot observe. Without drift that line is level: `offset = min(t_mono - tick * tick_ns)`. A
//! device clock that runs fast or slow tilts it: then it is the edge of the points' lower convex hull below their
//! mean, which is the line with the least mean distance to them (Moon, Skelly and Towsley, 1999).
//!
//! A coarse counter gives whole ticks: the sampling was anywhere within its tick. If the frames come at an even rate, the line
//! through the ticks against the frames' numbers is known far better than a tick, and is used. Otherwise the sampling is
//! taken to be in the middle of the tick, which is right on average, but not after the frame arrived.

use serde::Serialize;
use tactus_schema::{DeviceTick, MonoTime};

/// A residual beyond this is a jump of the device's clock, not a delay.
const JUMP_NS: f64 = 1e9;

/// No quartz drifts more; a larger slope is a jump.
const DRIFT_MAX: f64 = 500e-6;

/// Over a shorter time a drift cannot be distinguished from the delays.
const DRIFT_SPAN_NS: f64 = 60e9;

/// With ticks this short, an even rate is not looked for.
const FINE_TICK_NS: u64 = 10_000;

/// Least number of frames to estimate an even rate from.
const EVEN_FRAMES: usize = 30;

/// Ticks of an even rate are off its line by no more than this: half a tick, and a quarter as a margin.
const EVEN_TICKS: f64 = 0.75;

/// The estimated clock of one connection of the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EpochClock {
    /// Number of the connection, counted from 0 in a run.
    pub epoch: u32,
    /// Number of frames it was estimated from.
    pub frames: u64,
    /// Length of a device tick.
    pub tick_ns: u64,
    /// Ticks from frame to frame, if the device keeps an even rate: then its device time is on that grid.
    pub even_ticks: Option<f64>,
    /// Host monotonic time at device time zero of a device clock without drift; with drift, at `reference_tick`
    /// less that tick's device time.
    pub offset_ns: i64,
    /// Where the drift starts to count.
    pub reference_tick: u64,
    /// By how much the host's clock runs faster than the device's, in millionths; 0 unless it moves the sampling
    /// times by more than their uncertainty.
    pub drift_ppm: f64,
    /// One tick, and the residual that 5 % of the frames stay below: how sharp the lower edge is. The least delay
    /// itself is not in it.
    pub uncertainty_ns: i64,
    /// Delay beyond the least one that half the frames stay below.
    pub delay_p50_ns: i64,
    /// Delay beyond the least one that 99 % of the frames stay below.
    pub delay_p99_ns: i64,
}

/// Why a connection's ticks cannot give sampling times. Its frames are then dated by their arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoClock {
    /// The device has no clock, or its tick length is unknown.
    #[error("the device gave no clock")]
    Absent,
    /// Ticks ran backwards, or away from the host's clock by more than a second.
    #[error("the device's clock jumped")]
    Jumped,
}

impl EpochClock {
    /// Estimates the clock from the frames of one connection, in the order in which they arrived.
    ///
    /// # Errors
    /// If there are no frames, the tick length is zero, or the clock jumped.
    pub fn estimate(epoch: u32, tick_ns: u64, frames: &[(DeviceTick, MonoTime)]) -> Result<Self, NoClock> {
        let &[(reference, _), ..] = frames else { return Err(NoClock::Absent) };
        if tick_ns == 0 {
            return Err(NoClock::Absent);
        }
        if frames.windows(2).any(|pair| matches!(pair, [(a, _), (b, _)] if b < a)) {
            return Err(NoClock::Jumped);
        }
        let even_ticks = if tick_ns > FINE_TICK_NS { even_ticks(frames) } else { None };
        let base_ns = i128::from(frames[0].1.ns()) - device_ns(reference, tick_ns);
        let points: Vec<(f64, f64)> = frames
            .iter()
            .map(|&(tick, received)| {
                let device_ns = since_ns(reference, tick, tick_ns, even_ticks);
                (device_ns, (i128::from(received.ns()) - i128::from(frames[0].1.ns())) as f64 - device_ns)
            })
            .collect();
        let level =
            Line { slope: 0.0, at_zero: points.iter().map(|point| point.1).fold(f64::INFINITY, f64::min) };
        let tilted = lower_line(&points);
        let tilted_residuals = residuals(&points, tilted);
        let doubt_ns = tick_ns as f64 / even_ticks.map_or(1.0, |_| (frames.len() as f64).sqrt());
        let uncertainty = doubt_ns + share_below(&tilted_residuals, 0.05);
        let span_ns = points.last().map_or(0.0, |point| point.0);
        let drifts = span_ns >= DRIFT_SPAN_NS
            && tilted.slope.abs() <= DRIFT_MAX
            && (tilted.slope * span_ns).abs() > uncertainty;
        let (line, residuals) =
            if drifts { (tilted, tilted_residuals) } else { (level, residuals(&points, level)) };
        if residuals.last().is_some_and(|largest| *largest > JUMP_NS) {
            return Err(NoClock::Jumped);
        }
        Ok(Self {
            epoch,
            frames: frames.len() as u64,
            tick_ns,
            even_ticks,
            offset_ns: clamped(base_ns + i128::from(whole(line.at_zero))),
            reference_tick: reference.0,
            drift_ppm: line.slope * 1e6,
            uncertainty_ns: whole(doubt_ns + share_below(&residuals, 0.05)),
            delay_p50_ns: whole(share_below(&residuals, 0.50)),
            delay_p99_ns: whole(share_below(&residuals, 0.99)),
        })
    }

    /// When a frame was sampled, on the host's monotonic clock.
    pub fn sampled(&self, tick: DeviceTick, received: MonoTime) -> MonoTime {
        let Self { tick_ns, even_ticks, offset_ns, .. } = *self;
        let reference = DeviceTick(self.reference_tick);
        let since_ns = since_ns(reference, tick, tick_ns, even_ticks);
        let host_ns = whole(since_ns * (1.0 + self.drift_ppm * 1e-6));
        let sampled_ns = device_ns(reference, tick_ns) + i128::from(offset_ns) + i128::from(host_ns);
        let received_ns = i128::from(received.ns());
        let middle_ns = if even_ticks.is_some() { 0 } else { i128::from(tick_ns / 2) };
        MonoTime::from_ns(clamped((sampled_ns + middle_ns).min(received_ns.max(sampled_ns))))
    }
}

/// Ticks from frame to frame of a device that keeps an even rate.
fn even_ticks(frames: &[(DeviceTick, MonoTime)]) -> Option<f64> {
    if frames.len() < EVEN_FRAMES {
        return None;
    }
    let between = |pair: &[(DeviceTick, MonoTime)]| (pair[1].0.0 - pair[0].0.0) as f64;
    let mut steps: Vec<f64> = frames.windows(2).map(between).collect();
    steps.sort_by(f64::total_cmp);
    let median = share_below(&steps, 0.5);
    // Only pairs without a lost frame between them.
    steps.retain(|step| (step - median).abs() < 1.5);
    let nearly = steps.iter().sum::<f64>() / steps.len() as f64;
    if nearly < 1.0 {
        return None;
    }
    let mut number = 0.0;
    let mut points = vec![(0.0, 0.0)];
    for pair in frames.windows(2) {
        number += (between(pair) / nearly).round();
        points.push((number, (pair[1].0.0 - frames[0].0.0) as f64));
    }
    let count = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (mid_number, mid_ticks) = (mean(|point| point.0), mean(|point| point.1));
    let (mut along, mut spread) = (0.0, 0.0);
    for (number, ticks) in &points {
        along += (number - mid_number) * (ticks - mid_ticks);
        spread += (number - mid_number).powi(2);
    }
    let even = along / spread;
    let is_even =
        |(number, ticks): &(f64, f64)| (ticks - mid_ticks - even * (number - mid_number)).abs() < EVEN_TICKS;
    points.iter().all(is_even).then_some(even)
}

/// Device time since the first frame; on the grid of an even rate.
fn since_ns(reference: DeviceTick, tick: DeviceTick, tick_ns: u64, even_ticks: Option<f64>) -> f64 {
    let ticks = (i128::from(tick.0) - i128::from(reference.0)) as f64;
    even_ticks.map_or(ticks, |even| (ticks / even).round() * even) * tick_ns as f64
}

/// The device's time; bounded, so that sums with it cannot overflow.
fn device_ns(tick: DeviceTick, tick_ns: u64) -> i128 {
    i128::from(tick.0).saturating_mul(i128::from(tick_ns)).min(i128::MAX / 4)
}

#[derive(Clone, Copy)]
struct Line {
    slope: f64,
    at_zero: f64,
}

/// The line under all points with the least mean distance to them; points in order of x.
fn lower_line(points: &[(f64, f64)]) -> Line {
    let mut hull: Vec<(f64, f64)> = Vec::new();
    for &point in points {
        while let [.., a, b] = hull[..] {
            let turns_up = (b.0 - a.0) * (point.1 - a.1) - (b.1 - a.1) * (point.0 - a.0) > 0.0;
            if turns_up {
                break;
            }
            hull.pop();
        }
        // Of points at one device time, the lowest counts.
        match hull.last_mut() {
            Some(last) if last.0 >= point.0 => last.1 = last.1.min(point.1),
            _ => hull.push(point),
        }
    }
    let mean = points.iter().map(|point| point.0).sum::<f64>() / points.len() as f64;
    let edge = hull.windows(2).find(|edge| matches!(edge, [_, b] if b.0 >= mean));
    match (edge, hull.first()) {
        (Some([a, b]), _) => {
            let slope = (b.1 - a.1) / (b.0 - a.0);
            Line { slope, at_zero: a.1 - slope * a.0 }
        }
        (_, first) => Line { slope: 0.0, at_zero: first.map_or(0.0, |point| point.1) },
    }
}

/// Distances of the points above the line, sorted.
fn residuals(points: &[(f64, f64)], line: Line) -> Vec<f64> {
    let mut above: Vec<f64> = points.iter().map(|(x, y)| y - line.at_zero - line.slope * x).collect();
    above.sort_by(f64::total_cmp);
    above
}

/// The value that a share of the sorted values stays below.
fn share_below(sorted: &[f64], share: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index into the values")]
    let index = (sorted.len().saturating_sub(1) as f64 * share).round() as usize;
    sorted.get(index).copied().unwrap_or(0.0)
}

#[expect(clippy::cast_possible_truncation, reason = "saturates")]
fn whole(ns: f64) -> i64 {
    ns.round() as i64
}

fn clamped(ns: i128) -> i64 {
    i64::try_from(ns).unwrap_or(if ns < 0 { i64::MIN } else { i64::MAX })
}

#[cfg(test)]
#[path = "clock_tests.rs"]
mod tests;
