//! `tactus-bench evidence`.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use clap::{Args, Subcommand};
use tactus_bench::evidence::{
    self, Ablation, Bounds, Campaign, Costs, Counts, Form, Observed, Outcome, Places, Planned, Scores, Seeds,
    Size, Sizes, TWINS, Timing, Workflow, ablations, campaigns, cases, confirm, confirm_table,
    constants_table, contests, contests_table, curves, document, forms_table, into_document, misses, moments,
    pictures, progress_table, read, run, separate, summary, twins_table,
};
use tactus_work::write_whole;

use crate::worker_args::WorkerArgs;

#[derive(Debug, Args)]
pub(crate) struct EvidenceArgs {
    #[command(subcommand)]
    part: Part,
}

#[derive(Debug, Subcommand)]
enum Part {
    /// Makes sets, runs `tactus discover` on each and scores; continues an interrupted run. Workers that have the same folders share the
    /// sets.
    Run(RunArgs),
    /// Scores the sets that have been run.
    Score(WhichArgs),
    /// Writes into the labels of sets that have been run how far their physics is from the nearest wrong effect; continues an
    /// interrupted run. Workers that have the same folders share the sets.
    Separate(LabelArgs),
    /// Computes how near the curves of drafts come to the hidden physics, on paths that the sets that have been run do not have; continues an
    /// interrupted run. Workers that have the same folders share the sets.
    Curves(LabelArgs),
    /// Compares the drafts of the sets that have been run with new data of the same sensors: with the hidden physics, without it, and with
    /// another one in its place; continues an interrupted run. Workers that have the same folders share the sets.
    Confirm(ConfirmArgs),
    /// Prints what each value of the search's constants would do on the tuning sets that have been run.
    Constants(WhichArgs),
    /// Prints how near rivals without a name come to the effects that are named in the tuning sets that have been run.
    Contests(WhichArgs),
    /// Prints for each stage of a discovery how much time was left then, and how often the program would have told it right, in the tuning
    /// sets that have been run.
    Progress(WhichArgs),
    /// Prints how well the library's effects follow each form of hidden physics.
    Forms(FormsArgs),
    /// Measures time and memory of `tactus discover`, by default for 9,000 to 144,000 frames; prints JSON.
    Time(TimeArgs),
    /// Runs the cases that an experiment of the paper leaves undecided, with one active round each on the embedded rig.
    Active(ActiveArgs),
}

#[derive(Debug, Args)]
struct FormsArgs {
    /// Replace the table between its marks in this document.
    #[arg(long)]
    document: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct ActiveArgs {
    /// The program that discovers.
    #[arg(long, default_value = "target/dist/tactus")]
    tactus: PathBuf,
    /// Run only physics whose ids contain this.
    #[arg(long)]
    only: Option<String>,
    /// Folder of the recordings and reports.
    #[arg(long, default_value = "target/evidence/active")]
    work: PathBuf,
    /// Replace the table between its marks in this document.
    #[arg(long)]
    document: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct TimeArgs {
    /// The program that discovers.
    #[arg(long, default_value = "target/dist/tactus")]
    tactus: PathBuf,
    /// Numbers of frames, separated by commas.
    #[arg(long, value_delimiter = ',', default_values_t = [9_000, 36_000, 144_000, 1_000_000])]
    frames: Vec<usize>,
    /// Runs of each size; the median counts.
    #[arg(long, default_value_t = 3)]
    runs: usize,
    /// Folder of the sets and reports.
    #[arg(long, default_value = "target/evidence/time")]
    work: PathBuf,
}

#[derive(Debug, Args)]
struct RunArgs {
    #[command(flatten)]
    which: WhichArgs,
    /// The program that discovers.
    #[arg(long, default_value = "target/dist/tactus")]
    tactus: PathBuf,
    #[command(flatten)]
    worker: WorkerArgs,
    /// A further argument of `tactus discover`; may be given several times.
    #[arg(long = "with", allow_hyphen_values = true)]
    more: Vec<String>,
    /// Keep the tables of measurements and residuals, which the peers need.
    #[arg(long)]
    keep_tables: bool,
    /// Fail if the result of the slice is below its bounds.
    #[arg(long)]
    check: bool,
}

#[derive(Debug, Args)]
struct LabelArgs {
    #[command(flatten)]
    which: WhichArgs,
    #[command(flatten)]
    worker: WorkerArgs,
}

#[derive(Debug, Args)]
struct ConfirmArgs {
    #[command(flatten)]
    which: WhichArgs,
    /// The program that confirms drafts.
    #[arg(long, default_value = "target/dist/tactus")]
    tactus: PathBuf,
    #[command(flatten)]
    worker: WorkerArgs,
}

#[derive(Debug, Args)]
struct WhichArgs {
    /// Which sets: all, those for other methods, a first look of some hundred, a short loop of 54, a slice of 46, or the sample of 11 that CI runs.
    #[arg(long, value_enum, default_value = "whole")]
    size: Size,
    /// Campaigns, separated by commas; by default all.
    #[arg(long, value_enum, value_delimiter = ',')]
    campaign: Vec<Campaign>,
    /// Only sets whose ids contain this.
    #[arg(long)]
    only: Option<String>,
    /// Sets to work with, or those of the published tables: never choose anything by the latter.
    #[arg(long, value_enum, default_value = "tuning")]
    seeds: Seeds,
    /// Frames of a set; by default some 6,000.
    #[arg(long)]
    frames: Option<usize>,
    /// Folder of the reports and results; by default target/evidence/SEEDS/work.
    #[arg(long)]
    work: Option<PathBuf>,
    /// Folder of the labels, for the scorer only; by default target/evidence/SEEDS/labels.
    #[arg(long)]
    labels: Option<PathBuf>,
    /// A work folder with the reports of other methods in `peers`, for the same labels.
    #[arg(long)]
    ablation: Option<PathBuf>,
    /// Time and memory: a JSON file with `ours`, from `evidence time`, and `peers`.
    #[arg(long)]
    costs: Option<PathBuf>,
    /// Replace the tables between the marks of this document.
    #[arg(long)]
    document: Option<PathBuf>,
    /// Write the pictures into this folder.
    #[arg(long)]
    images: Option<PathBuf>,
}

impl EvidenceArgs {
    pub(crate) fn run(self) -> Result<()> {
        match self.part {
            Part::Run(args) => args.run(),
            Part::Score(which) => which.score_all(),
            Part::Separate(args) => args.separate(),
            Part::Curves(args) => args.curves(),
            Part::Confirm(args) => args.run(),
            Part::Constants(which) => which.constants(),
            Part::Contests(which) => which.contests(),
            Part::Progress(which) => which.progress(),
            Part::Forms(args) => args.run(),
            Part::Time(args) => args.run(),
            Part::Active(args) => args.run(),
        }
    }
}

impl TimeArgs {
    fn run(self) -> Result<()> {
        let timing = Timing::measure(&self.tactus, &self.work, &self.frames, self.runs)?;
        println!("{}", serde_json::to_string_pretty(&timing)?);
        Ok(())
    }
}

impl FormsArgs {
    fn run(&self) -> Result<()> {
        let text = forms_table(&Form::all()?);
        println!("{text}");
        match &self.document {
            Some(path) => into(path, evidence::Part::Forms, &text),
            None => Ok(()),
        }
    }
}

impl ActiveArgs {
    fn run(self) -> Result<()> {
        let mut decisions = Vec::new();
        for twins in
            TWINS.iter().filter(|twins| self.only.as_ref().is_none_or(|part| twins.physics.contains(part)))
        {
            decisions.push(twins.decide(&self.tactus, &self.work)?);
            println!("{}/{} {}", decisions.len(), TWINS.len(), twins.physics);
        }
        let text = twins_table(&decisions);
        println!("{text}");
        if let Some(path) = &self.document {
            into(path, evidence::Part::Active, &text)?;
        }
        Ok(())
    }
}

impl RunArgs {
    fn run(self) -> Result<()> {
        self.which.check_seeds()?;
        let (sets, places) = (self.which.sets(), self.which.places());
        let workflow = Workflow { tactus: self.tactus, more: self.more, keeps_tables: self.keep_tables };
        let claims = places.work.join("claims").join("discovery");
        self.worker.work("sets", claims, |worker, progress| {
            run(&sets, self.which.seeds, &places, &workflow, worker, progress)
        })?;
        let outcomes = self.which.score()?;
        if !self.check {
            return Ok(());
        }
        let counts = Counts::of(&outcomes);
        println!("{}\n{counts}", summary(&outcomes));
        match self.which.size {
            Size::Sample => Bounds::SAMPLE.check(&counts),
            Size::Whole | Size::Ablation | Size::Glance | Size::Quick | Size::Slice => {
                Bounds::SLICE.check(&counts)
            }
        }
    }
}

impl LabelArgs {
    fn separate(&self) -> Result<()> {
        self.which.check_seeds()?;
        let (sets, places) = (self.which.sets(), self.which.places());
        let claims = places.work.join("claims").join("separation");
        self.worker.work("sets", claims, |worker, progress| separate(&sets, &places, worker, progress))
    }

    fn curves(&self) -> Result<()> {
        self.which.check_seeds()?;
        let (sets, places) = (self.which.sets(), self.which.places());
        let claims = places.work.join("claims").join("curves");
        self.worker.work("sets", claims, |worker, progress| curves(&sets, &places, worker, progress))
    }
}

impl ConfirmArgs {
    fn run(&self) -> Result<()> {
        self.which.check_seeds()?;
        let (sets, places) = (self.which.sets(), self.which.places());
        let claims = places.work.join("claims").join("confirmation");
        self.worker.work("sets", claims, |worker, progress| {
            confirm(&sets, &places, &self.tactus, worker, progress)
        })?;
        let text = confirm_table(&cases(&sets, &places)?);
        println!("{text}");
        match &self.which.document {
            Some(path) => into(path, evidence::Part::Confirm, &text),
            None => Ok(()),
        }
    }
}

impl WhichArgs {
    fn sets(&self) -> Vec<Planned> {
        let sizes = Sizes { frames: self.frames, ..self.size.sizes() };
        let chosen = if self.campaign.is_empty() { &Campaign::ALL[..] } else { &self.campaign };
        let sets = chosen.iter().flat_map(|campaign| campaigns(*campaign, &sizes, self.seeds));
        sets.filter(|set| self.only.as_ref().is_none_or(|part| set.id.contains(part))).collect()
    }

    fn places(&self) -> Places {
        let folder = Path::new("target/evidence").join(self.seeds.name());
        Places {
            work: self.work.clone().unwrap_or_else(|| folder.join("work")),
            labels: self.labels.clone().unwrap_or_else(|| folder.join("labels")),
        }
    }

    fn constants(&self) -> Result<()> {
        self.check_tuning()?;
        println!("{}", constants_table(&Observed::read(&self.sets(), &self.places())?));
        Ok(())
    }

    fn contests(&self) -> Result<()> {
        self.check_tuning()?;
        println!("{}", contests_table(&contests(&self.sets(), &self.places())?));
        Ok(())
    }

    fn progress(&self) -> Result<()> {
        self.check_tuning()?;
        println!("{}", progress_table(&moments(&self.sets(), &self.places())?));
        Ok(())
    }

    fn check_tuning(&self) -> Result<()> {
        ensure!(self.seeds == Seeds::Tuning, "constants are chosen by this: take --seeds tuning");
        Ok(())
    }

    /// Who looks at a part of the sealed sets could choose by them.
    fn check_seeds(&self) -> Result<()> {
        let is_part = self.only.is_some() || !self.campaign.is_empty();
        ensure!(
            self.seeds.may_show(self.size, is_part),
            "sealed sets are run all together: leave out --only and --campaign, and give no --size but whole or ablation; or take --seeds \
             tuning"
        );
        Ok(())
    }

    fn ablations(&self) -> Result<Vec<Ablation>> {
        let Some(work) = &self.ablation else { return Ok(Vec::new()) };
        let sizes = Sizes::ablation();
        let sets = Campaign::ALL.into_iter().flat_map(|campaign| campaigns(campaign, &sizes, self.seeds));
        let sets: Vec<Planned> = sets.collect();
        ablations(&sets, &Places { work: work.clone(), ..self.places() })
    }

    fn costs(&self) -> Result<Option<Costs>> {
        let Some(path) = &self.costs else { return Ok(None) };
        let text = fs::read_to_string(path).with_context(|| path.display().to_string())?;
        Ok(Some(serde_json::from_str(&text).with_context(|| path.display().to_string())?))
    }

    /// Scores sets that have all been run, if they are sealed ones: a part of them says something else.
    fn score_all(&self) -> Result<()> {
        self.check_seeds()?;
        let (sets, places) = (self.sets(), self.places());
        let left = sets.iter().filter(|set| !places.ran(&set.id).exists()).count();
        ensure!(
            self.seeds == Seeds::Tuning || left == 0,
            "{left} of {} sealed sets have not been run: `tactus-bench evidence run` goes on with them",
            sets.len()
        );
        self.score().map(drop)
    }

    fn score(&self) -> Result<Vec<Outcome>> {
        let outcomes = read(&self.sets(), &self.places())?;
        let scores = Scores::new(&outcomes);
        let text = document(&scores, &self.ablations()?, self.costs()?.as_ref());
        match self.size {
            Size::Quick => println!("{}", summary(&outcomes)),
            Size::Whole | Size::Ablation | Size::Glance | Size::Slice | Size::Sample => println!("{text}"),
        }
        let Places { work, .. } = self.places();
        write(&work.join("evidence.json"), &serde_json::to_string_pretty(&scores)?)?;
        write(&work.join("evidence.md"), &text)?;
        if self.seeds == Seeds::Tuning {
            write(&work.join("misses.txt"), &misses(&outcomes))?;
        }
        if let Some(path) = &self.document {
            into(path, evidence::Part::Evidence, &text)?;
        }
        if let Some(folder) = &self.images {
            for (name, picture) in pictures(&scores) {
                write(&folder.join(name), &picture)?;
            }
        }
        Ok(outcomes)
    }
}

/// Replaces a part of a document.
fn into(path: &Path, part: evidence::Part, text: &str) -> Result<()> {
    let before = fs::read_to_string(path).with_context(|| path.display().to_string())?;
    let after = into_document(&before, part, text);
    write(path, &after.with_context(|| format!("{} has no marks for this part", path.display()))?)
}

fn write(path: &Path, text: &str) -> Result<()> {
    write_whole(path, text.as_bytes()).with_context(|| path.display().to_string())
}
