//! How many files this process may have open.

use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use tracing::warn;

/// Lets this process, and what it starts, have as many files open as the system allows it. A shell usually begins with 1,024, which is what
/// some 500 rigs need.
pub fn allow_all() {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current != maximum
        && let Err(error) = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum })
    {
        let allowed = current.map_or_else(|| "all".to_owned(), |files| files.to_string());
        warn!("this process cannot have more than {allowed} files open: {error}");
    }
}

#[cfg(test)]
#[path = "open_files_tests.rs"]
mod tests;
