//! Work of many pieces, shared by threads, processes and machines that see one folder.
//!
//! The result of a piece is in the folder or it is not: so work that was cut off goes on where it ended, and nothing else has to be
//! remembered. [`work()`] takes one open piece after the other on each thread. A worker claims a piece before it begins ([`Claims`]), so that
//! workers of one folder share its pieces; the pieces of a worker that dies are taken over after a lease. Memory holds one piece for each
//! thread.
//!
//! | module | does |
//! |---|---|
//! | `claim` | which worker has a piece |
//! | `worker` | one worker's way through the pieces |
//! | `terms` | what all results in a folder have in common |
//! | `stop` | Ctrl-C |
//! | `whole_file` | files that appear whole |
//! | `threads` | threads that take one item after the other |
//! | `bar` | the progress bar |

mod bar;
mod claim;
mod stop;
mod terms;
mod threads;
mod whole_file;
mod worker;

pub use bar::{Bar, Now};
pub use claim::{ClaimError, Claims, LEASE_S};
pub use stop::Stop;
pub use terms::{TermsError, agree};
pub use threads::{cores, for_each};
pub use whole_file::write_whole;
pub use worker::{Work, Worked, Worker, work};
