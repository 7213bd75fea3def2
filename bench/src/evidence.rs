//! How well `tactus discover` finds and names hidden physics.
//!
//! A *campaign* is a list of sets, each made from its own seed ([`campaigns()`]). [`run()`] makes the sets, writes their
//! labels into a separate folder, and starts the program `tactus`, which gets a measurement table and nothing else. Only
//! [`read()`] opens the labels; it compares them with the reports. [`Scores`] counts the outcomes, [`summary()`],
//! [`document()`] and [`pictures()`] present them. Any number of workers share the sets of a folder ([`tactus_work`]).

mod ablation;
mod bounds;
mod campaign;
mod confirm;
mod constants;
mod contests;
mod curves;
mod document;
mod drafts;
mod forms;
mod outcome;
mod picture;
mod progress;
mod rate;
mod run;
mod score;
mod separate;
mod summary;
mod timing;
mod twins;

pub use ablation::{Ablation, ablations};
pub use bounds::{Bounds, Counts};
pub use campaign::{Campaign, Planned, Seeds, Size, Sizes, campaigns};
pub use confirm::{Case, Confirmed, Measured, Told, cases, confirm, confirm_table};
pub use constants::{Observed, Place, constants_table};
pub use contests::{Contest, contests, contests_table};
pub use curves::{Curve, curves};
pub use document::{Costs, Part, document, into_document, misses};
pub use forms::{Form, forms_table};
pub use outcome::{Named, Outcome, Truth, read};
pub use picture::pictures;
pub use progress::{Moment, moments, progress_table};
pub use rate::{Rate, normal_share, quantile};
pub use run::{Places, Ran, Workflow, run};
pub use score::{
    Band, Cell, EffectScore, ORACLE_LEVEL, OutsideScore, PowerPoint, Scores, SetSize, Several, Shrink,
    Spread, Z_DETECTABLE, Z_NAMEABLE, Z_SEPARATE,
};
pub use separate::separate;
pub use summary::summary;
pub use timing::{Cost, Timing};
pub use twins::{BUDGET_MIN, Chosen, Decision, TWINS, Twins, Undecided, twins_table};
