//! What holds for the repository as a whole.

mod ci;
mod dependencies;
mod modules;
mod references;
