use tactus_schema::{
    key::{Keys, Topic},
    pb,
};
use zenoh::{key_expr::keyexpr, qos::Priority};

use super::{Lane, Policy, Published, encoding, heard, message_name};

#[test]
fn every_topic_names_the_message_of_the_contract() {
    let names: Vec<_> = Topic::ALL.iter().map(|topic| (topic.suffix(), message_name(*topic))).collect();
    assert_eq!(
        names,
        [
            ("sensor/frame", "tactus.v1.Frame"),
            ("sensor/info", "tactus.v1.SensorInfo"),
            ("stage/state", "tactus.v1.StageState"),
            ("run/event", "tactus.v1.RunEvent"),
            ("run/state", "tactus.v1.RunState"),
            ("health", "tactus.v1.Health"),
            ("safety/state", "tactus.v1.SafetyEvent"),
        ]
    );
    assert_eq!(pb::SafetyEvent::TOPIC, Topic::SafetyState);
}

#[test]
fn the_encoding_is_written_as_other_languages_see_it() {
    assert_eq!(encoding("tactus.v1.Frame").to_string(), "application/protobuf;tactus.v1.Frame");
}

#[test]
fn frames_and_news_travel_apart_and_neither_with_answers_for_history() {
    let frames = Policy::of(Topic::SensorFrame);
    for topic in Topic::ALL {
        let policy = Policy::of(topic);
        let is_frame = topic == Topic::SensorFrame;
        assert_eq!(policy.lane == Lane::Frames, is_frame, "{topic:?}");
        assert_eq!(policy.priority == frames.priority, is_frame, "{topic:?}");
        assert_ne!(policy.priority, Priority::Data, "{topic:?}");
    }
}

#[test]
fn who_hears_a_topic_hears_no_other_and_does_not_number_its_key() {
    let keys = Keys::new("bench");
    for topic in Topic::ALL {
        let heard = heard(&keys.topic(topic));
        let heard = keyexpr::new(&heard).unwrap();
        // Zenoh numbers a key up to the part with the first wild card.
        assert!(heard.is_wild());
        for other in Topic::ALL {
            let key = keys.topic(other);
            assert_eq!(heard.intersects(keyexpr::new(&key).unwrap()), other == topic, "{heard}, {key}");
        }
    }
}
