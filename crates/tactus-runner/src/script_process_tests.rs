use tactus_schema::Rig;

use super::*;
use crate::embedded::SIMULATED_RIG;

/// Evaluates with a program of the shell instead of the script's process.
fn resolve_with(shell: &str, stopped: &dyn Fn() -> bool) -> ScriptError {
    let script = Script::parse("s", "def run(rig):\n    pass\n").unwrap();
    let view = RigView::of(&Rig::from_toml(SIMULATED_RIG).unwrap());
    let processes = ScriptProcesses { program: "/bin/sh".into(), leading: vec!["-c".into(), shell.into()] };
    processes.resolve(&script, &Arguments::default(), &view, &ScriptLimits::default(), stopped).unwrap_err()
}

#[test]
fn the_end_of_the_process_tells_the_limit() {
    let limits = ScriptLimits::default();
    for (ending, exceeded) in [
        ("kill -XCPU $$", Some(Exceeded::Processor(limits.processor))),
        (
            "echo 'memory allocation of 4096 bytes failed' >&2; kill -ABRT $$",
            Some(Exceeded::Process(512 << 20)),
        ),
        (
            "echo \"thread 'script' has overflowed its stack\" >&2; kill -ABRT $$",
            Some(Exceeded::Stack(64 << 20)),
        ),
        ("echo 'what is this' >&2; kill -SEGV $$", None),
        ("exit 0", None),
    ] {
        match (resolve_with(ending, &|| false), exceeded) {
            (ScriptError::Limit { exceeded, .. }, Some(wanted)) => assert_eq!(exceeded, wanted, "{ending}"),
            (ScriptError::Evaluator { problem, .. }, None) => {
                assert!(problem.starts_with("its process ended, "), "{ending}: {problem}");
            }
            (other, _) => panic!("{ending}: {other:?}"),
        }
    }
}

#[test]
fn what_cannot_be_understood_is_an_error() {
    for garbage in ["printf '\\001\\000\\000\\000\\377'", "printf '\\377\\377\\377\\377x'"] {
        let error = resolve_with(&format!("{garbage}; cat"), &|| false);
        assert!(error.to_string().contains("its process sent"), "{error}");
    }
    let error = ScriptProcesses::of("/nowhere").resolve(
        &Script::parse("s", "def run(rig):\n    pass\n").unwrap(),
        &Arguments::default(),
        &RigView::of(&Rig::from_toml(SIMULATED_RIG).unwrap()),
        &ScriptLimits::default(),
        &|| false,
    );
    assert!(error.unwrap_err().to_string().contains("no process for the script"));
}

#[test]
fn a_process_that_neither_reads_nor_answers_ends_with_the_run() {
    let error = resolve_with("exec sleep 1000", &|| true);
    assert!(matches!(error, ScriptError::Refused { refusal: Refusal::Stopped(_), .. }), "{error}");
}
