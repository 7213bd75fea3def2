//! `tactus-mock hidden`: lists the physics, makes sets.

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;

use anyhow::{Context, Result};
use clap::{Args, Subcommand};
use rayon::iter::{IntoParallelIterator, ParallelIterator};
use serde_json::json;
use tactus_hidden::{CATALOGUE, Definition};
use tactus_sets::{Amount, Content, Label, NoiseKind, Plan, Recipe};

#[derive(Debug, Args)]
pub(crate) struct HiddenArgs {
    #[command(subcommand)]
    command: HiddenCommand,
}

#[derive(Debug, Subcommand)]
enum HiddenCommand {
    /// Lists all physics: id, the library's effect that it is an instance of, "point" if that effect can do exactly this, what it does.
    List {
        /// As JSON.
        #[arg(long)]
        json: bool,
    },
    /// Makes measurement tables with hidden physics, and their labels in another folder.
    Make(MakeArgs),
}

#[derive(Debug, Args)]
struct MakeArgs {
    /// Folder for the tables `set-0000.parquet`, ...
    #[arg(long)]
    out: PathBuf,
    /// Folder for the labels `set-0000.json`, ...: for the scorer only.
    #[arg(long)]
    sealed: PathBuf,
    /// Number of sets.
    #[arg(long, default_value_t = 1)]
    count: usize,
    /// Seed of everything random; set k has the seed plus k.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Physics by id, several with commas.
    #[arg(long, value_delimiter = ',')]
    physics: Vec<String>,
    /// Any physics that is an instance of this effect. Can be repeated.
    #[arg(long)]
    effect: Vec<String>,
    /// Number of different effects of the library, chosen at random.
    #[arg(long)]
    combine: Option<usize>,
    /// A physics outside the library, chosen at random.
    #[arg(long)]
    outside: bool,
    /// No physics at all.
    #[arg(long, conflicts_with_all = ["physics", "effect", "combine", "outside"])]
    none: bool,
    /// Strength by separation: an oracle distinguishes each physics from the base model by this many standard deviations.
    #[arg(long, conflicts_with = "strength")]
    z: Option<f64>,
    /// As `--z`, after the point spread is recalibrated too.
    #[arg(long, conflicts_with_all = ["strength", "z"])]
    z_beyond_spread: Option<f64>,
    /// Strength of each physics: 1 is that of a bad rig.
    #[arg(long, default_value_t = 1.0)]
    strength: f64,
    /// What the stage does.
    #[arg(long, value_enum, default_value_t)]
    plan: Plan,
    /// Frames of a set. Default: the plan's number.
    #[arg(long)]
    frames: Option<usize>,
    /// Noise of the readings.
    #[arg(long, value_enum, default_value_t)]
    noise: NoiseKind,
}

impl HiddenArgs {
    pub(crate) fn run(self) -> Result<()> {
        match self.command {
            HiddenCommand::List { json } => list(json),
            HiddenCommand::Make(args) => args.run(),
        }
    }
}

fn list(as_json: bool) -> Result<()> {
    let mut out = io::stdout().lock();
    if as_json {
        let all: Vec<_> = CATALOGUE
            .iter()
            .map(|Definition { id, effect, is_library_point, about, .. }| {
                json!({ "id": id, "effect": effect, "is_library_point": is_library_point, "about": about })
            })
            .collect();
        writeln!(out, "{}", json!(all))?;
    } else {
        for Definition { id, effect, is_library_point, about, .. } in CATALOGUE {
            let point = if *is_library_point { "point" } else { "" };
            writeln!(out, "{id:32}{:24}{point:7}{about}", effect.unwrap_or("-"))?;
        }
    }
    Ok(out.flush()?)
}

impl MakeArgs {
    fn run(&self) -> Result<()> {
        for folder in [&self.out, &self.sealed] {
            fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
        (0..self.count).into_par_iter().try_for_each(|index| self.make(index))
    }

    fn make(&self, index: usize) -> Result<()> {
        let name = format!("set-{index:04}");
        let recipe = Recipe {
            name: name.clone(),
            seed: self.seed.wrapping_add(index as u64),
            plan: self.plan,
            frames: self.frames,
            noise: self.noise,
            content: self.content(),
            amount: self.amount(),
        };
        let set = recipe.make()?;
        set.write(self.out.join(format!("{name}.parquet")))?;
        let sealed = self.sealed.join(format!("{name}.json"));
        fs::write(&sealed, serde_json::to_string_pretty(&set.label)?)
            .with_context(|| sealed.display().to_string())?;
        warn_of_unreached(&set.label)
    }

    fn amount(&self) -> Amount {
        match (self.z, self.z_beyond_spread) {
            (Some(z), _) => Amount::Separation(z),
            (None, Some(z)) => Amount::BeyondSpread(z),
            (None, None) => Amount::Strength(self.strength),
        }
    }

    fn content(&self) -> Content {
        Content {
            physics: self.physics.clone(),
            effects: self.effect.clone(),
            combine: self.combine,
            outside: self.outside,
            none: self.none,
        }
    }
}

/// Warns if a separation was out of reach. It does not name the physics: only the label may.
fn warn_of_unreached(label: &Label) -> Result<()> {
    let mut err = io::stderr().lock();
    for _ in label.physics.iter().filter(|dosed| !dosed.reached) {
        writeln!(err, "{}: the requested separation is out of reach; the label has the nearest", label.set)?;
    }
    Ok(())
}
