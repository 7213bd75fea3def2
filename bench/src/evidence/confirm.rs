//! What new data of a set's sensor say of its draft: with the physics that was drafted, without any, and with another one.

use std::collections::BTreeMap;
use std::fmt;
use std::fs::{self, File};
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde::{Deserialize, Serialize};
use tactus_hidden::{CATALOGUE, DraftTruth};
use tactus_schema::DraftFile;
use tactus_schema::draft::DraftStatus;
use tactus_sets::{Content, DataSet, PhysicsLabel, Recipe};
use tactus_work::{Now, Stop, Work, Worked, Worker, work, write_whole};
use tempfile::TempDir;

use super::campaign::Planned;
use super::curves::drafted;
use super::outcome::{parsed, read};
use super::rate::quantile;
use super::run::Places;
use crate::program::{digest, watched};

/// What new data say of a draft.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Told {
    /// It holds.
    Confirmed,
    /// It does not.
    Refuted,
    /// They do not suffice to tell.
    TooLittle,
}

/// A draft beside new data.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// What they say of it.
    pub told: Told,
    /// Its strength there; 1 as it was drafted.
    pub strength: Option<f64>,
    /// Standard error of the strength.
    pub strength_se: Option<f64>,
    /// Share of what is left without it that it closes, on presses that were not fitted.
    pub closed_share: Option<f64>,
    /// Its standard error.
    pub closed_share_se: Option<f64>,
}

impl Measured {
    const TOO_LITTLE: Self = Self {
        told: Told::TooLittle,
        strength: None,
        strength_se: None,
        closed_share: None,
        closed_share_se: None,
    };
}

/// What new data of its sensor say of the draft of a set.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Confirmed {
    /// SHA-256 of the draft's file.
    pub draft: String,
    /// SHA-256 of the program.
    pub program: String,
    /// With the physics that it was drafted from.
    pub with: Measured,
    /// Without any physics.
    pub without: Measured,
    /// With another physics in its place, of the same separation.
    pub other: Measured,
}

/// A set with physics outside the library that has a mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    /// Id of the physics.
    pub physics: String,
    /// Whether the draft has the right stage and covariate; `None` without a draft.
    pub is_right: Option<bool>,
    /// What new data say of the draft; `None` without one.
    pub confirmed: Option<Confirmed>,
}

/// Exit code of `tactus` if recordings do not suffice, among other things.
const USAGE: i32 = 2;
/// What it says then.
const TOO_SHORT: &str = "too short to tell";

/// Makes new data of the sensor of each set that has a draft of physics outside the library, and compares the draft with them as
/// `tactus effects confirm` does, beside what else the discovery has named. The results are for the scorer only. Those of the same draft and program
/// are kept. Workers that have the same folders share the sets.
///
/// # Errors
/// If data cannot be made, a file cannot be read or written, or the program fails.
pub fn confirm(
    sets: &[Planned],
    places: &Places,
    tactus: &Path,
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked> {
    work(&Confirmations { places, tactus, program: digest(tactus)? }, sets, worker, progress)
}

/// The comparisons of all drafts.
struct Confirmations<'a> {
    places: &'a Places,
    tactus: &'a Path,
    /// SHA-256 of the program.
    program: String,
}

impl Work for Confirmations<'_> {
    type Piece = Planned;
    type Made = Confirmed;
    type Error = anyhow::Error;

    fn name(&self, set: &Planned) -> String {
        set.id.clone()
    }

    fn is_done(&self, set: &Planned) -> Result<bool> {
        if drafted(set, self.places)?.is_none() {
            return Ok(true);
        }
        Ok(Confirmed::read(&set.id, self.places)?.is_some_and(|known| known.program == self.program))
    }

    fn make(&self, set: &Planned, stop: &Stop) -> Result<Option<Confirmed>> {
        let hidden = drafted(set, self.places)?.with_context(|| format!("{} had a draft", set.id))?;
        let draft = digest(&self.places.draft(&set.id))?;
        let recipe = set.recipe.clone();
        let Some(data) = stop.unless_set(move || anew(&recipe, &hidden)) else { return Ok(None) };
        let mut all = Vec::new();
        for data in data.with_context(|| set.id.clone())? {
            let Some(measured) = self.compared(set, &data, stop)? else { return Ok(None) };
            all.push(measured);
        }
        let [with, without, other] = all[..] else { bail!("{}: three comparisons", set.id) };
        Ok(Some(Confirmed { draft, program: self.program.clone(), with, without, other }))
    }

    fn keep(&self, set: &Planned, confirmed: Confirmed) -> Result<()> {
        let path = self.places.confirmed(&set.id);
        let text = serde_json::to_vec_pretty(&confirmed).with_context(|| set.id.clone())?;
        write_whole(&path, &text).with_context(|| path.display().to_string())
    }
}

impl Confirmations<'_> {
    /// Compares the draft of a set with data. The paths that the program sees say nothing of the set; `None` if it was stopped.
    fn compared(&self, set: &Planned, data: &DataSet, stop: &Stop) -> Result<Option<Measured>> {
        let now = self.places.work.join("now");
        fs::create_dir_all(&now).with_context(|| at(&now))?;
        let folder = TempDir::new_in(&now).with_context(|| at(&now))?;
        let [library, table, model, log] =
            ["library", "new.parquet", "model.toml", "log"].map(|name| folder.path().join(name));
        data.write(&table).with_context(|| at(&table))?;
        copied(&self.places.model(&set.id), &model)?;
        let name = draft_of(&self.places.draft(&set.id))?.draft.name;
        let draft = library.join(format!("{name}.toml"));
        copied(&self.places.draft(&set.id), &draft)?;
        let mut confirm = Command::new(self.tactus);
        confirm.args(["--json", "effects", "--library"]).arg(&library).args(["confirm", &name]).arg(&table);
        confirm.arg("--model").arg(&model).env("RAYON_NUM_THREADS", "1");
        // What it refuses it says on the standard output, as JSON.
        let heard = File::create(&log).with_context(|| at(&log))?;
        confirm.stdout(heard.try_clone().with_context(|| at(&log))?).stderr(heard);
        // A terminal's Ctrl-C is for the worker alone, which ends the program.
        confirm.process_group(0);
        let Some(watched) = watched(&mut confirm, stop)? else { return Ok(None) };
        let said = fs::read(&log).with_context(|| at(&log))?;
        let said = String::from_utf8_lossy(&said);
        let told = || measured(watched.exit.code(), &draft_of(&draft)?, &said);
        told().with_context(|| set.id.clone()).map(Some)
    }
}

impl Confirmed {
    /// That of the draft of a set; `None` if it is not there, or of another draft.
    fn read(id: &str, places: &Places) -> Result<Option<Self>> {
        let (confirmed, draft) = (places.confirmed(id), places.draft(id));
        if !confirmed.exists() || !draft.exists() {
            return Ok(None);
        }
        let (confirmed, draft) = (parsed::<Self>(&confirmed)?, digest(&draft)?);
        Ok(Some(confirmed).filter(|confirmed| confirmed.draft == draft))
    }
}

/// What the program has told: its exit code, the file of the draft, and what it said.
fn measured(exit: Option<i32>, file: &DraftFile, said: &str) -> Result<Measured> {
    if exit == Some(USAGE) && said.contains(TOO_SHORT) {
        return Ok(Measured::TOO_LITTLE);
    }
    let told = match file.status {
        DraftStatus::Confirmed => Told::Confirmed,
        DraftStatus::Refuted => Told::Refuted,
        DraftStatus::Drafted | DraftStatus::Partial | DraftStatus::Retired => bail!("no comparison: {said}"),
    };
    let Some(seen) = file.confirmation.as_ref().filter(|_| exit == Some(0)) else { bail!("{said}") };
    Ok(Measured {
        told,
        strength: Some(seen.strength),
        strength_se: seen.strength_se,
        closed_share: seen.closed_share,
        closed_share_se: seen.closed_share_se,
    })
}

/// New data of a set's sensor: with its physics, without any, and with another one in its place.
fn anew(recipe: &Recipe, hidden: &PhysicsLabel) -> Result<[DataSet; 3]> {
    let physics = vec![next_after(&hidden.id).context("it is in the catalogue")?.to_owned()];
    let other = Recipe { content: Content { physics, ..Content::default() }, ..recipe.clone() };
    let other = other.make()?.label.physics;
    let [with, without, other] =
        [std::slice::from_ref(hidden), &[], &other[..]].map(|physics| recipe.make_anew(physics));
    Ok([with?, without?, other?])
}

/// The next physics outside the library that has a mean; after the last one the first.
fn next_after(id: &str) -> Option<&'static str> {
    let drafted: Vec<&str> =
        CATALOGUE.iter().map(|physics| physics.id).filter(|id| DraftTruth::find(id).is_some()).collect();
    let place = drafted.iter().position(|one| *one == id)?;
    Some(drafted[(place + 1) % drafted.len()])
}

/// The sets with physics outside the library that has a mean and that have been run.
///
/// # Errors
/// If a label, a report or a result cannot be read.
pub fn cases(sets: &[Planned], places: &Places) -> Result<Vec<Case>> {
    let mut cases = Vec::new();
    for outcome in read(sets, places)? {
        let Some(truth) = outcome.truths.first().filter(|one| DraftTruth::find(&one.physics).is_some())
        else {
            continue;
        };
        cases.push(Case {
            physics: truth.physics.clone(),
            is_right: outcome.draft.as_ref().map(|draft| draft.is_right(&truth.physics)),
            confirmed: Confirmed::read(&outcome.id, places)?,
        });
    }
    Ok(cases)
}

/// The table of `docs/discovery-evidence.md`: all sets, those with right drafts and with others, and each physics.
pub fn confirm_table(cases: &[Case]) -> String {
    let mut rows: BTreeMap<(u8, &str), Vec<&Case>> = BTreeMap::new();
    for case in cases {
        rows.entry((0, "all")).or_default().push(case);
        match case.is_right {
            Some(true) => rows.entry((1, "all, with a right draft")).or_default().push(case),
            Some(false) => rows.entry((2, "all, with another draft")).or_default().push(case),
            None => {}
        }
        rows.entry((3, &case.physics)).or_default().push(case);
    }
    fmt::from_fn(|f| {
        writeln!(
            f,
            "Cells of three numbers: drafts that the new data confirm / refute / are too few to tell of. Without the physics, or with another \
             one in its place, none should be confirmed.\n\n\
             | physics | sets | drafted | right | with it | strength, median | closes, median | without it | another in its place |\n\
             |---|---|---|---|---|---|---|---|---|"
        )?;
        for ((_, name), cases) in &rows {
            row(f, name, cases)?;
        }
        Ok(())
    })
    .to_string()
}

fn row(f: &mut fmt::Formatter<'_>, name: &str, cases: &[&Case]) -> fmt::Result {
    let confirmed: Vec<&Confirmed> = cases.iter().filter_map(|case| case.confirmed.as_ref()).collect();
    let told = |of: fn(&Confirmed) -> Measured| {
        let count = |told: Told| confirmed.iter().filter(|one| of(one).told == told).count();
        [Told::Confirmed, Told::Refuted, Told::TooLittle].map(|told| count(told).to_string()).join(" / ")
    };
    let median = |of: fn(&Measured) -> Option<f64>| {
        quantile(confirmed.iter().filter_map(|one| of(&one.with)).collect(), 0.5)
    };
    let strength = median(|one| one.strength).map_or_else(|| "-".into(), |strength| format!("{strength:.2}"));
    let closed =
        median(|one| one.closed_share).map_or_else(|| "-".into(), |share| format!("{:.0} %", 100.0 * share));
    writeln!(
        f,
        "| {name} | {} | {} | {} | {} | {strength} | {closed} | {} | {} |",
        cases.len(),
        cases.iter().filter(|case| case.is_right.is_some()).count(),
        cases.iter().filter(|case| case.is_right == Some(true)).count(),
        told(|one| one.with),
        told(|one| one.without),
        told(|one| one.other),
    )
}

fn draft_of(path: &Path) -> Result<DraftFile> {
    let text = fs::read_to_string(path).with_context(|| at(path))?;
    DraftFile::from_toml(&text).with_context(|| at(path))
}

/// Copies a file into a folder that is made.
fn copied(from: &Path, to: &Path) -> Result<()> {
    let bytes = fs::read(from).with_context(|| at(from))?;
    write_whole(to, &bytes).with_context(|| at(to))
}

fn at(path: &Path) -> String {
    path.display().to_string()
}

#[cfg(test)]
#[path = "confirm_tests.rs"]
mod tests;
