"""Plants defects, one at a time, and checks that the tests find each.

A mutant that no test finds is a hole in the tests. The last commit is copied to target/mutants and changed there.

    python3 tests/mutants/run.py [WORD]     only the mutants whose name has the word
"""

import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
COPY = REPOSITORY / "target" / "mutants" / "source"

SAFETY = "crates/tactus-safety/src/"
ENGINE = "crates/tactus-engine/src/"
DEVICE = "crates/tactus-device/src/stage/"

# Name, file, what stands there once, what is planted instead, the package whose tests must find it.
MUTANTS = [
    ("elements that fall cancel the load", SAFETY + "force.rs", "(rise_counts - band_counts).max(0.0)", "rise_counts - band_counts", "tactus-safety"),
    ("the sign of an element is ignored", SAFETY + "force.rs", "{ rise_counts * sign }", "{ rise_counts * sign.abs() }", "tactus-safety"),
    ("a tare lifts the limit", SAFETY + "force.rs", "against_tare.or_else(|| self.over(reference, 0.0, limits, \"the run's first zero\"))", "against_tare", "tactus-safety"),
    ("a zero may be anywhere", SAFETY + "force.rs", "(counts - baseline_counts).abs() > self.rig.band_counts", "(counts - baseline_counts).abs() < 0.0", "tactus-safety"),
    ("no limit before the first zero", SAFETY + "force.rs", "return self.over(&self.rig.baseline_counts, band_counts, limits, \"the rig's baseline\");", "let _ = band_counts; return None;", "tactus-safety"),
    ("a silent element is no matter", SAFETY + "force.rs", "is_silent.then_some((element, silent_s))", "(is_silent && false).then_some((element, silent_s))", "tactus-safety"),
    ("zeros outlive a connection", SAFETY + "supervisor.rs", "self.elements.forget_zeros();\n        self.permits.revoke();", "self.permits.revoke();", "tactus-safety"),
    ("a trip does not latch", SAFETY + "supervisor.rs", "self.fault = Some(Fault::Tripped(violation.clone()));", "", "tactus-safety"),
    ("a trip leaves permits valid", SAFETY + "supervisor.rs", "self.permits.revoke();\n        if violation.is_silence() {", "if violation.is_silence() {", "tactus-safety"),
    ("a fault permits the way down", SAFETY + "supervisor.rs", "self.check_fault()?;\n        self.limits", "self.limits", "tactus-safety"),
    ("no frame is needed to go down", SAFETY + "supervisor.rs", "if age_s <= limit_s { Ok(()) } else { Err(Denied::NoFreshFrame", "if age_s <= limit_s || true { Ok(()) } else { Err(Denied::NoFreshFrame", "tactus-safety"),
    ("no zero is needed to go down", SAFETY + "supervisor.rs", "if !self.elements.has_zero() {", "if false {", "tactus-safety"),
    ("homing is not watched", SAFETY + "supervisor.rs", "let is_homing = self.status() == StageStatus::Homing;", "let is_homing = false;", "tactus-safety"),
    ("the depth's sign is wrong", SAFETY + "limits.rs", "if -z_mm > self.depth_max_mm", "if z_mm > self.depth_max_mm", "tactus-safety"),
    ("steps down may be long", SAFETY + "limits.rs", "if is_deep && step_mm", "if false && step_mm", "tactus-safety"),
    ("sideways in contact", SAFETY + "limits.rs", "if aside_mm > motion.tolerance_mm &&", "if false && aside_mm > motion.tolerance_mm &&", "tactus-safety"),
    ("a thick covering passes the cap", "crates/tactus-schema/src/rig.rs", ".min(self.depth_max_mm)", "", "tactus-safety"),
    ("permits do not expire", SAFETY + "permit.rs", "now > expires", "now < expires && now > expires", "tactus-safety"),
    ("permits cannot be revoked", SAFETY + "permit.rs", "self.revocation.count() != self.revocations", "self.revocation.count() < self.revocations", "tactus-safety"),
    ("a frozen array is believed", SAFETY + "contact.rs", "repeated.frames >= FROZEN_FRAMES", "repeated.frames > 1000", "tactus-safety"),
    ("a reset does not rearm", SAFETY + "supervisor.rs", "self.fault.replace(Fault::Unfinished)", "self.fault.take()", "tactus-safety"),
    ("another covering is not confirmed", ENGINE + "engine.rs", "let wanted_mm = control.wanted_covering_mm.filter(unconfirmed);", "let wanted_mm = control.wanted_covering_mm.filter(unconfirmed).filter(|_| false);", "tactus-engine"),
    ("the thicker covering counts after a restart", ENGINE + "engine.rs", "kept_mm.min(in_file_mm)", "kept_mm.max(in_file_mm)", "tactus-engine"),
    ("a dwell does not ask the stage", ENGINE + "run/steps.rs", "if average.is_disturbed || !is_same {", "if false && (average.is_disturbed || !is_same) {", "tactus-engine"),
    ("an alarm is noticed at the end of a dwell", ENGINE + "acquisition.rs", "            self.window = None;\n", "", "tactus-engine"),
    ("a panic of the run leaves the tip", ENGINE + "run.rs", "let retracted = run.end(&result).await;\n    run.conclude(&result, retracted).await\n}", "run.conclude(&result, Ok(0.0)).await\n}", "tactus-engine"),
    ("an unwatched stage moves on", DEVICE + "driver.rs", "unwatched(&mut self.watched), if is_watched", "unwatched(&mut self.watched), if false && is_watched", "tactus-device"),
    ("a permit is not checked at the byte that moves", DEVICE + "driver.rs", "match self.check_leave() {", "match self.check_leave().or(Ok::<(), Void>(())) {", "tactus-device"),
    ("nobody guards the driver", DEVICE + "guard.rs", "if silent >= HANG_MAX {", "if false && silent >= HANG_MAX {", "tactus-device"),
    ("a panic of the driver leaves the stage moving", DEVICE + "driver.rs", "&& let Err(error) = link.send(&halt).await", "&& let Err(error) = link.send(&halt[..0]).await", "tactus-device"),
    ("a permit outlives the next", SAFETY + "permit.rs", "        self.revoke();\n        Permit {", "        Permit {", "tactus-safety"),
    ("a permit outlives the place", SAFETY + "supervisor.rs", "&& !self.stands_at(stood_mm)", "&& false", "tactus-safety"),
    ("an old report of the stage is believed", SAFETY + "supervisor.rs", "self.check_report(now)?;", "", "tactus-safety"),
    ("an element that is not read has no limit", SAFETY + "force.rs", "if let Some(element) = (0..zero.len().max(1)).find(is_unread) {", "if let Some(element) = (0..0).find(is_unread) {", "tactus-safety"),
    ("a failed reset forgets that the tip is not up", SAFETY + "supervisor.rs", "if let Some(fault) = self.not_retracted.take() {", "if let Some(fault) = self.not_retracted.take().filter(|_| false) {", "tactus-safety"),
    ("a frame that reads nothing is believed", SAFETY + "force.rs", "        let unwatched = &self.rig.unwatched;\n", "        self.last_frame = Some(at);\n        let unwatched = &self.rig.unwatched;\n", "tactus-safety"),
    ("a thinner covering counts only once it is confirmed", ENGINE + "run/steps.rs", "let is_thinner = thickness_mm <= before.thickness_mm;", "let is_thinner = thickness_mm < 0.0;", "tactus-engine"),
    ("stops hold the rising tip", ENGINE + "engine.rs", "if self.shared.way_up().takes_stop(self.shared.clock.now().mono) {", "if true {", "tactus-engine"),
    ("a stop of the supervisor takes the place of somebody's", ENGINE + "engine.rs", "        self.permits.revoke();\n        self.stage.stop();", "        self.way_up().takes_stop(self.clock.now().mono);\n        self.permits.revoke();\n        self.stage.stop();", "tactus-engine"),
    ("lost frames hold the rising tip", ENGINE + "acquisition.rs", "if is_a_failure && self.shared.end(Ending::FramesLost(frames_lost)) {", "if is_a_failure && (self.shared.end(Ending::FramesLost(frames_lost)) || true) {", "tactus-engine"),
    ("a retract that fails is not tried again", ENGINE + "motion.rs", "if troubles > TROUBLES_MAX ||", "if troubles > 0 ||", "tactus-engine"),
    ("a tip that is not up is no fault", ENGINE + "motion.rs", "self.latch_not_retracted(broken.to_string()).await;", "let _ = broken;", "tactus-engine"),
    ("a thick covering must be felt like a thin one", SAFETY + "contact.rs", ".powi(2).min(1.0)", ".powi(2).clamp(1.0, 1.0)", "tactus-safety"),
]


def main() -> int:
    word = sys.argv[1] if len(sys.argv) > 1 else ""
    COPY.mkdir(parents=True, exist_ok=True)
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=REPOSITORY, check=True, capture_output=True).stdout
    subprocess.run(["tar", "-x", "-C", COPY], input=archive, check=True)
    survivors = []
    for name, file, there, planted, package in MUTANTS:
        if word not in name:
            continue
        path = COPY / file
        text = path.read_text()
        if text.count(there) != 1:
            print(f"?? {name}: {file} has its text {text.count(there)} times; see MUTANTS")
            survivors.append(name)
            continue
        path.write_text(text.replace(there, planted))
        outcome = tests(package)
        path.write_text(text)
        print(f"{'ok' if outcome == 'found' else '??'} {name}: {outcome}", flush=True)
        if outcome != "found":
            survivors.append(name)
    if survivors:
        print(f"{len(survivors)} mutants were not found: {'; '.join(survivors)}")
    return 1 if survivors else 0


def tests(package: str) -> str:
    """Whether the package's tests find the defect. A mutant that does not compile proves nothing."""
    cargo = ["cargo", "test", "--quiet", "--package", package, "--target-dir", COPY.parent / "build"]
    built = subprocess.run([*cargo, "--no-run"], cwd=COPY, capture_output=True, text=True)
    if built.returncode != 0:
        return f"does not compile\n{built.stderr[-2000:]}"
    try:
        run = subprocess.run(cargo, cwd=COPY, capture_output=True, timeout=300)
    except subprocess.TimeoutExpired:
        return "found"
    return "found" if run.returncode != 0 else "NOT FOUND"


if __name__ == "__main__":
    sys.exit(main())
