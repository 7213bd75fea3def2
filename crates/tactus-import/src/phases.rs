//! What the stage was doing, from its path.

use tactus_schema::table::Phase;

/// A tip that stays within the tolerance for this long stands.
const STANDS_NS: i64 = 100_000_000;
/// And in at least so many frames.
const STANDS_FRAMES: usize = 3;
/// Share of the greatest depth that counts as no contact.
const TOUCH_SHARE: f64 = 0.005;

/// The phase and the press of each frame of a run; positions in the robot frame, the surface at z = 0.
///
/// A press is a stretch of frames below the surface by more than `touch_mm`: without it, more than `still_mm` and than half a percent of
/// the deepest frame, because a tip that rests on the covering does not come back to the same place. In a press the tip holds where it
/// stands, and else loads or unloads. Before it, it approaches as long as it comes down without a stand; after it, it retracts as long
/// as it goes up.
pub(crate) fn of_path(
    t_ns: &[i64],
    position_mm: &[[f64; 3]],
    still_mm: f64,
    touch_mm: Option<f64>,
) -> Vec<(Phase, i32)> {
    let frames = t_ns.len();
    let stands = standing(t_ns, position_mm, still_mm);
    let z_mm = |frame: usize| position_mm[frame][2];
    let depth_max_mm = (0..frames).map(|frame| -z_mm(frame)).fold(0.0, f64::max);
    let touch_mm = touch_mm.unwrap_or(still_mm.max(TOUCH_SHARE * depth_max_mm));
    let touches = |frame: usize| z_mm(frame) < -touch_mm;
    let mut phases = vec![(Phase::Idle, -1); frames];
    let (mut frame, mut press) = (0, 0);
    while frame < frames {
        if !touches(frame) {
            frame += 1;
            continue;
        }
        let first = frame;
        let mut moving = Phase::Load;
        while frame < frames && touches(frame) {
            let rise_mm = z_mm((frame + 1).min(frames - 1)) - z_mm(frame.saturating_sub(1));
            if rise_mm < 0.0 {
                moving = Phase::Load;
            } else if rise_mm > 0.0 {
                moving = Phase::Unload;
            }
            phases[frame] = (if stands[frame] { Phase::Hold } else { moving }, press);
            frame += 1;
        }
        for before in (0..first).rev() {
            if stands[before] || phases[before].0 != Phase::Idle || z_mm(before) < z_mm(before + 1) - still_mm
            {
                break;
            }
            phases[before] = (Phase::Approach, press);
        }
        for after in frame..frames {
            if stands[after] || touches(after) || z_mm(after) < z_mm(after - 1) - still_mm {
                break;
            }
            phases[after] = (Phase::Retract, press);
        }
        press += 1;
    }
    phases
}

/// The press of each frame, from the phases alone: a new one begins where the tip comes down after it went up or stood idle.
pub(crate) fn presses(phases: &[Phase]) -> Vec<i32> {
    let (mut press, mut last) = (-1, Phase::Idle);
    let one = |phase: &Phase| {
        let begins = !matches!(phase, Phase::Idle | Phase::Retract);
        let ended = matches!(last, Phase::Idle | Phase::Retract);
        press += i32::from(begins && ended);
        last = *phase;
        if *phase == Phase::Idle { -1 } else { press }
    };
    phases.iter().map(one).collect()
}

/// Frames of stretches in which the tip stays within the tolerance.
fn standing(t_ns: &[i64], position_mm: &[[f64; 3]], still_mm: f64) -> Vec<bool> {
    let mut stands = vec![false; t_ns.len()];
    let mut first = 0;
    while first < t_ns.len() {
        let [mut least, mut most] = [position_mm[first]; 2];
        let mut end = first + 1;
        while end < t_ns.len() {
            for axis in 0..3 {
                least[axis] = least[axis].min(position_mm[end][axis]);
                most[axis] = most[axis].max(position_mm[end][axis]);
            }
            if (0..3).any(|axis| most[axis] - least[axis] > still_mm) {
                break;
            }
            end += 1;
        }
        if end - first >= STANDS_FRAMES && t_ns[end - 1] - t_ns[first] >= STANDS_NS {
            stands[first..end].fill(true);
            first = end;
        } else {
            first += 1;
        }
    }
    stands
}

#[cfg(test)]
#[path = "phases_tests.rs"]
mod tests;
