//! The service's core, its drivers and virtual devices in virtual time, under random scripts, clients and faults. What is
//! checked is the true tip, not what the service believes. A seed plays the same again; a schedule that breaks a promise is
//! reduced to a small one, whose text plays again, too.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on fails")]
#![expect(clippy::print_stdout, reason = "a night's schedules tell what they find at once")]

#[path = "schedules/play.rs"]
mod play;
#[path = "schedules/schedule.rs"]
mod schedule;
#[path = "schedules/tally.rs"]
mod tally;
#[path = "schedules/watch.rs"]
mod watch;

use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use play::play;
use schedule::{Event, Schedule};
use tactus_virtual::schedule::{Shrunk, shrink};
use tally::Tally;
use watch::{Broken, Strictness};

/// Schedules of one test; `TACTUS_SCHEDULES` sets another number, `TACTUS_FIRST` the first seed. `TACTUS_SEED` plays one seed,
/// and `TACTUS_SCHEDULE` one text.
const SCHEDULES: u64 = 24;

/// Failing schedules that are reduced, and how often each is played for it.
const SHRUNK_MAX: usize = 3;
const TRIES_MAX: u32 = 300;

/// A schedule that breaks promises.
struct Failure {
    schedule: Schedule,
    broken: Vec<Broken>,
}

/// Plays the schedules of all seeds, on every core.
fn play_seeds(seeds: Range<u64>) -> (Tally, Vec<Failure>) {
    let next = AtomicU64::new(seeds.start);
    let results = Mutex::new((Tally::default(), Vec::new()));
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                loop {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= seeds.end {
                        return;
                    }
                    let schedule = Schedule::of_seed(seed);
                    let played = play(&schedule, Strictness::default());
                    let mut results = results.lock().unwrap();
                    results.0.merge(played.tally);
                    if !played.broken.is_empty() {
                        // At once: a night's schedules may be cut short.
                        println!("seed {seed} breaks {:?}", played.broken);
                        results.1.push(Failure { schedule, broken: played.broken });
                    }
                }
            });
        }
    });
    let (tally, mut failures) = results.into_inner().unwrap();
    failures.sort_by_key(|failure| failure.schedule.seed);
    (tally, failures)
}

/// The smallest schedule found that breaks the same promise.
fn reduce(schedule: &Schedule, promise: &'static str, strictness: Strictness) -> (Schedule, Shrunk<Event>) {
    let with = |events: &[Event]| Schedule { events: events.to_vec(), ..*schedule };
    let fails = |events: &[Event]| breaks(&with(events), promise, strictness);
    let shrunk = shrink(&schedule.events, Event::simpler, fails, TRIES_MAX);
    (with(&shrunk.events), shrunk)
}

fn breaks(schedule: &Schedule, promise: &str, strictness: Strictness) -> bool {
    play(schedule, strictness).broken.iter().any(|broken| broken.promise == promise)
}

impl Failure {
    /// For a person, with the smallest schedule if there is time to find it.
    fn describe(&self, reduces: bool) -> String {
        let Self { schedule, broken } = self;
        let told: Vec<_> = broken.iter().map(ToString::to_string).collect();
        let text = format!("seed {} breaks {}", schedule.seed, told.join("\n  and "));
        match broken.first().filter(|_| reduces) {
            None => text,
            Some(first) => {
                let (small, shrunk) = reduce(schedule, first.promise, Strictness::default());
                format!("{text}\n  reduced by {} plays; again with TACTUS_SCHEDULE='{small}'", shrunk.tries)
            }
        }
    }
}

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok()?.parse().ok()
}

/// The one schedule that is asked for.
fn asked() -> Option<Schedule> {
    let text = std::env::var("TACTUS_SCHEDULE").ok();
    let schedule = text.map(|text| text.parse().unwrap_or_else(|error| panic!("TACTUS_SCHEDULE: {error}")));
    schedule.or_else(|| number("TACTUS_SEED").map(Schedule::of_seed))
}

#[test]
fn whatever_happens_the_true_tip_keeps_its_limit_and_nothing_false_is_told() {
    if let Some(schedule) = asked() {
        let played = play(&schedule, Strictness::default());
        println!("{schedule}\n{}{}", played.log, played.tally);
        assert!(played.broken.is_empty(), "{}", Failure { schedule, broken: played.broken }.describe(true));
        return;
    }
    let first = number("TACTUS_FIRST").unwrap_or(0);
    let (tally, failures) = play_seeds(first..first + number("TACTUS_SCHEDULES").unwrap_or(SCHEDULES));
    println!("{tally}");
    let told: Vec<_> =
        failures.iter().enumerate().map(|(at, failure)| failure.describe(at < SHRUNK_MAX)).collect();
    assert!(told.is_empty(), "{} schedules fail\n{}", told.len(), told.join("\n"));
}

#[test]
fn a_seed_plays_the_same_again() {
    for seed in [1, 3] {
        let schedule = Schedule::of_seed(seed);
        assert_eq!(
            play(&schedule, Strictness::default()).log,
            play(&schedule, Strictness::default()).log,
            "seed {seed}"
        );
    }
}

#[test]
fn the_text_of_a_schedule_gives_it_again() {
    for seed in 0..500 {
        let schedule = Schedule::of_seed(seed);
        assert_eq!(schedule.to_string().parse(), Ok(schedule), "seed {seed}");
    }
    for (text, why) in [
        ("", "begins with"),
        ("seed 1; rig tower", "begins with"),
        ("seed 1; rig grbl; at noon stage reset", "no event"),
        ("seed 1; rig grbl; at 5 stage explode", "no fault"),
        ("seed 1; rig grbl; at 5 client explode", "no event"),
    ] {
        let error = text.parse::<Schedule>().unwrap_err();
        assert!(error.contains(why), "{text}: {error}");
    }
}

/// Presses for some twenty seconds, with a fault or a client now and then.
const EVENTFUL: &str = "seed 7; rig grbl; at 500 sensor duplicate; at 3000 client pause; at 4000 client resume; \
     at 8000 sensor stall 1200ms; at 10000 from-stage repeat; at 11000 sensor stall 1200ms; at 12500 sensor clock-drift 200; \
     at 14000 sensor stall 1200ms; at 17000 sensor stall 1200ms; run 0 tare(); run 0 press(8, 6, [0.2, 0.4, 0.5]); \
     run 0 press(4, 6, [0.5]); run 0 press(9, 3, [0.4]); run 0 wait(0.3); run 1 tare()";

#[test]
fn a_schedule_that_breaks_a_promise_is_reduced_to_what_it_takes() {
    // As if a depth of 0.3 mm were a defect: it takes one press. As if a silence were one: it takes a stall, and a press.
    let depth = Strictness { depth_max_mm: Some(0.3), ..Strictness::default() };
    let silence = Strictness { never: Some("silence"), ..Strictness::default() };
    let schedule: Schedule = EVENTFUL.parse().unwrap();
    for (promise, strictness, events) in [("depth", depth, 1), ("never", silence, 2)] {
        assert!(breaks(&schedule, promise, strictness));
        let (small, shrunk) = reduce(&schedule, promise, strictness);
        assert!(!shrunk.is_cut_short && small.events.len() == events, "{small}");
        let again: Schedule = small.to_string().parse().unwrap();
        let played = [&small, &again].map(|schedule| play(schedule, strictness));
        assert!(played[0].broken.iter().any(|broken| broken.promise == promise), "{small}");
        assert_eq!((&played[0].log, &played[0].broken), (&played[1].log, &played[1].broken), "{small}");
        assert_eq!(reduce(&schedule, promise, strictness).0, small, "twice the same");
    }
}
