//! Who may do what on a service's bus, as zenoh's access control.
//!
//! Everything that a client sends passes through the service's own node, so what it refuses reaches nobody. What is not
//! listed here is refused: a client can neither publish, nor answer, nor announce a service, nor command or ask many rigs at once.

use serde_json::{Value, json};
use tactus_schema::key::{Command, Keys, STOP_EVERY_RIG};

use crate::{BusConfig, config::TlsConfig};

/// Every key: `**` does not match zenoh-ext's keys, which have `@`.
const EVERYTHING: [&str; 2] = ["**", "**/@adv/**"];

/// The rules for the service of these rigs.
pub(crate) fn rules(config: &BusConfig, rigs: &[Keys]) -> Value {
    let guests: Vec<_> = config.guests.iter().map(Keys::new).collect();
    let served = || rigs.iter().chain(&guests);
    let asks: Vec<_> = served().flat_map(readable).chain([STOP_EVERY_RIG.to_owned()]).collect();
    let commands: Vec<_> = served().flat_map(commandable).collect();
    let mut rules = vec![
        json!({ "id": "hear", "flows": ["ingress"], "permission": "allow", "key_exprs": EVERYTHING,
            "messages": ["declare_subscriber", "liveliness_query", "declare_liveliness_subscriber"] }),
        json!({ "id": "ask", "flows": ["ingress"], "permission": "allow", "messages": ["query"], "key_exprs": asks }),
        json!({ "id": "command", "flows": ["ingress"], "permission": "allow", "messages": ["query"], "key_exprs": commands }),
        json!({ "id": "tell", "flows": ["egress"], "permission": "allow", "key_exprs": EVERYTHING, "messages": ALL_MESSAGES }),
    ];
    let mut commanding = vec!["hear", "ask", "command", "tell"];
    if !guests.is_empty() {
        let theirs: Vec<_> = guests
            .iter()
            .flat_map(|keys| ["**", "**/@adv/**"].map(|rest| format!("tactus/{}/{rest}", keys.rig())))
            .collect();
        rules.push(
            json!({ "id": "guest", "flows": ["ingress"], "permission": "allow", "messages": ALL_MESSAGES,
            "key_exprs": theirs.into_iter().chain([STOP_EVERY_RIG.to_owned()]).collect::<Vec<_>>() }),
        );
        commanding.push("guest");
    }
    let mut subjects = vec![json!({ "id": "local", "link_protocols": ["tcp", "unixsock-stream"] })];
    let mut policies = vec![json!({ "rules": commanding, "subjects": ["local"] })];
    if let Some(TlsConfig { commanders, readers, .. }) = &config.tls {
        for (id, names, rules) in
            [("commanders", commanders, &commanding[..]), ("readers", readers, &["hear", "ask", "tell"])]
        {
            if !names.is_empty() {
                subjects.push(json!({ "id": id, "link_protocols": ["tls"], "cert_common_names": names }));
                policies.push(json!({ "rules": rules, "subjects": [id] }));
            }
        }
    }
    json!({ "enabled": true, "default_permission": "deny", "rules": rules, "subjects": subjects, "policies": policies })
}

const ALL_MESSAGES: [&str; 9] = [
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
];

/// What anybody may ask: the histories of a rig's topics, the state, a stop. The histories have one rule: zenoh takes a quarter of a kilobyte
/// for each part of each key, and whoever may ask for all of them one by one may ask for all at once.
fn readable(keys: &Keys) -> impl Iterator<Item = String> {
    let histories = format!("tactus/{}/**/@adv/**", keys.rig());
    [histories, keys.command(Command::Status), keys.command(Command::Stop)].into_iter()
}

fn commandable(keys: &Keys) -> impl Iterator<Item = String> {
    Command::ALL.map(|command| keys.command(command)).into_iter()
}
