//! Drafts of what no class explains: a search in a small grammar.
//!
//! A draft is a [`tactus_model::effect::Draft`]: a carrier, when it acts, a curve of one covariate or two, and a weight for each element or
//! none. The [`grammar`] lists them. At a model, one pass gives the products of all with the residual, knot by knot of their curves, and a
//! test by flipped signs says whether noise would give as much to any of them. A second pass weighs those that come first by their
//! evidence, as classes are weighed. The best one gets its form ([`form`]): knots, weights of the elements, a second covariate, and a law if one
//! passes through its curve ([`curves`]); and is fitted once more as the effect that the draft is.
//!
//! The columns are those of the draft itself: a constant draft gives what one unit of each carrier does, and the covariates are those that
//! the draft will see in a simulation ([`sight`]).
//!
//! Held-out presses take no part.

mod curves;
mod form;
mod grammar;
mod sight;
mod words;

use std::ops::Range;
use std::sync::{Arc, Mutex, PoisonError};

use nalgebra::DMatrix;
use tactus_model::effect::{Draft, PipelineStage};

use self::form::AsEffect;
use self::grammar::Atom;
use self::sight::{KNOTS_OF_ELEMENTS, Sight};
use super::evidence::{Addition, Evidence, Gain, Signs};
use super::grow::{ALPHA, FLIPS, Search};
use super::not_shown::NotShown;
use super::score::{Score, flipped, largest, p_value};
use crate::data::DiscoverError;
use crate::fit::{BLOCKS_MAX, FOLDS, Fitted, Free, Grams, Sparse, Term, in_a_row};
use crate::numbers::parallel;
use crate::progress::Stage;

/// Atoms that are weighed by their evidence.
const WEIGHED_MAX: usize = 12;
/// Greatest number of columns of a pass: the parts of blocks take memory.
const COLUMNS_MAX: usize = 512;
/// Greatest number of columns times blocks times elements of a pass, which takes 8 bytes for each. Of the paper's sensor that is more than all atoms
/// have that are weighed.
const PARTS_MAX: usize = 2 * COLUMNS_MAX * 48 * BLOCKS_MAX;
/// Drafts that are tried as effects, the best first.
const TRIED_MAX: usize = 3;
/// Knots of the curve of a covariate, and of a second one beside it.
const KNOTS: usize = 7;
const KNOTS_OF_SECOND: usize = 4;
/// By distance of what acts on every element, near or far: the range is wide.
const KNOTS_OF_DISTANCE: usize = 12;
/// Logarithm of the odds by which a draft must be ahead of every class.
const AHEAD_LN_ODDS: f64 = 5.0;
/// Least part of a draft that recalibration and the model do not take up.
const OWN_LEAST: f64 = 0.05;
/// In so many folds the same atom must come first.
const FOLDS_LEAST: usize = 4;
/// Changes the seed, so that drafts have other sign flips than classes and covariates.
const STREAM: u64 = 0x000d_4af7;

/// A draft that passed the gates, and the model with it.
pub(crate) struct Drafted {
    pub(crate) draft: Draft,
    /// The grown model with the draft as its last term, of strength 1.
    pub(crate) at: Fitted,
    /// Covariance of the law's numbers, or of the table's values.
    pub(crate) covariance: Vec<Vec<f64>>,
    /// The curve's knots with their standard errors, as they were before a law passed through them; of a single covariate.
    pub(crate) knots: Vec<[f64; 3]>,
    /// Probability that noise gives as much to any draft of the grammar.
    pub(crate) p_value: f64,
    /// Logarithm of its odds against none.
    pub(crate) ln_odds: f64,
    /// The same, with a charge for each number of its law or table, for each weight, and for its choice from the grammar: what names are compared
    /// with, of which each number is charged.
    pub(crate) ln_odds_as_chosen: f64,
    /// In how many of five folds it came first.
    pub(crate) folds: usize,
    /// By how much it is nearer to presses that its curve has not seen, block by block.
    pub(crate) unseen_gains: Vec<f64>,
    /// The classes that come nearest, with by how much each is behind.
    pub(crate) nearest: Vec<(&'static str, f64)>,
    /// Other drafts that these data cannot tell from it, in words.
    pub(crate) alike: Vec<String>,
}

impl Drafted {
    /// Its name.
    pub(crate) fn name(&self) -> &'static str {
        self.at.parameters.terms.last().map_or("", |term| term.definition.name)
    }

    /// True if another one acts on the same by the same.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        self.draft.carrier == other.draft.carrier && self.draft.covariates[0] == other.draft.covariates[0]
    }
}

/// Why there is no draft.
#[derive(Debug, Clone, PartialEq)]
pub enum NoDraft {
    /// Noise would give as much to some draft.
    Noise,
    /// A class of the library explains nearly as much: its name.
    Class(&'static str),
    /// Folds of the presses prefer different drafts.
    Unsteady,
    /// Recalibration takes up most of it.
    TakenUp,
    /// As an effect it gains too little.
    NoGain,
    /// With it the model is further from presses that its fit has not seen.
    Further,
    /// On such presses it closes the smaller part of what is left.
    SmallerPart {
        /// What it would have said.
        sentence: String,
        /// The share.
        share: f64,
    },
    /// The fitted presses leave nothing to draft: what is left shows on the held-out presses alone.
    OnlyHeldOut,
    /// In contact it adds no more than what rounding repeats.
    Rounding,
    /// It acts where a name acts, and so little that it may be an error of the name's form.
    OfAName,
}

impl NoDraft {
    /// The reason in words.
    pub fn in_words(&self) -> String {
        match self {
            Self::Noise => "noise would give as much to some draft of the grammar".into(),
            Self::Class(class) => format!("{class} of the library explains nearly as much"),
            Self::Unsteady => "different parts of the data prefer different drafts".into(),
            Self::TakenUp => "recalibration takes up most of what it would explain".into(),
            Self::NoGain => "as an effect it explains too little".into(),
            Self::Further => {
                "what comes first takes the model further from presses that its fit has not seen".into()
            }
            Self::SmallerPart { sentence, share } => format!(
                "what comes first closes {:.0} % of what is left on presses that its fit has not seen: {sentence}",
                100.0 * share
            ),
            Self::OnlyHeldOut => {
                "the fitted presses leave nothing to draft: what is left shows on the held-out presses alone"
                    .into()
            }
            Self::Rounding => "in contact it adds no more than what the converter's rounding repeats".into(),
            Self::OfAName => "it may be an error of the form of a name that acts at the same place".into(),
        }
    }
}

/// What a draft has to be better than.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Against<'a> {
    /// Every class but those that the data refute.
    Classes {
        /// Those.
        refuted: &'a [&'a str],
    },
    /// The nearest names, which leave much: how far their model is from the fitted presses.
    Names {
        /// One of them.
        nearest: &'static str,
        /// The cost of their model.
        cost: f64,
    },
}

/// The outcome of drafting.
pub(crate) type Outcome = Result<Box<Drafted>, NoDraft>;

/// An atom with its columns in one of the passes that test each column by itself.
struct Screened<'a> {
    atom: &'a Atom,
    own: Range<usize>,
    grams: Arc<Grams>,
}

/// An atom with its columns in a pass.
struct Weighed {
    atom: Atom,
    directions: Vec<usize>,
}

/// What drafting at a model begins with, whatever a draft has to be better than.
pub(super) struct Begun {
    /// Probability that noise gives as much to any atom.
    p_value: f64,
    /// The atoms that come first, with their products; none where that is likely.
    weighed: Option<(Vec<Weighed>, Grams)>,
    /// Number of atoms of the grammar.
    count: f64,
    /// The atoms that were tried as effects, by their places among those that are weighed and the names of the effects.
    tried: Mutex<Vec<((usize, String), Unseen)>>,
}

/// An atom as an effect, and by how much it is nearer to presses that its numbers have not seen, block by block; `None` if it gains nothing.
type Unseen = Option<(AsEffect, Vec<f64>)>;

/// Atoms that compete.
struct Field<'a> {
    begun: &'a Begun,
    weighed: &'a [Weighed],
    grams: &'a Grams,
    additions: &'a [Addition],
    /// Those that are still in it, with the logarithm of their odds, greatest first.
    ranked: Vec<(usize, f64)>,
    /// The classes of the library that come nearest, with the logarithm of their odds.
    classes: Vec<(&'static str, f64)>,
}

/// The atom of a field that is tried as an effect.
struct Best {
    /// Its place among those that are weighed.
    atom: usize,
    ln_odds: f64,
    /// Others that are as good, in words.
    alike: Vec<String>,
}

impl Field<'_> {
    /// Leaves out an atom and all that act on the same by the same.
    fn leave_out(&mut self, best: usize) {
        let weighed = self.weighed;
        self.ranked.retain(|(one, _)| !weighed[*one].atom.is_like(&weighed[best].atom));
    }

    fn is_like(&self, one: usize, other: usize) -> bool {
        self.weighed[one].atom.is_like(&self.weighed[other].atom)
    }
}

impl Search<'_> {
    /// Drafts what a model leaves, as an effect of this name. If what comes first is no draft, that which comes next is tried, as if the first
    /// were not in the grammar. If noise would give as much to any draft with a probability above `alpha`, which is [`ALPHA`] at most, or what comes
    /// first acts at one of the `closed` stages, there is none.
    pub(crate) fn draft(
        &self,
        at: &Fitted,
        name: &str,
        alpha: f64,
        against: Against<'_>,
        closed: &[PipelineStage],
    ) -> Result<Outcome, DiscoverError> {
        let sight = Arc::new(Sight::of(self.problem, at)?);
        self.reporter.enter(Stage::Drafting, "drafting what nobody has named");
        let begun = self.memory.drafts.at(&at.parameters, || self.begun(at, &sight).map(Arc::new))?;
        let Some((weighed, grams)) = begun.weighed.as_ref().filter(|_| begun.p_value <= alpha) else {
            return Ok(Err(NoDraft::Noise));
        };
        let additions = additions(weighed, grams, begun.count);
        let mut field = Field {
            ranked: ranked(&self.evidence_of(&additions, grams.reduced())),
            additions: &additions,
            begun: &begun,
            weighed,
            grams,
            classes: self.classes(at, against)?,
        };
        let mut why = NoDraft::NoGain;
        for nth in 0..TRIED_MAX {
            let Some(best) = self.best(at, &sight, &field)? else { break };
            let atom = best.atom;
            let Atom { carrier, covariates, .. } = &field.weighed[atom].atom;
            if closed.contains(&carrier.stage(covariates)) {
                return Ok(Err(NoDraft::OfAName));
            }
            match self.drafted(at, &sight, &field, best, (name, against))? {
                Ok(found) => return Ok(Ok(found)),
                Err(other) if nth == 0 => why = other,
                Err(_) => (),
            }
            field.leave_out(atom);
        }
        Ok(Err(why))
    }

    fn begun(&self, at: &Fitted, sight: &Arc<Sight>) -> Result<Begun, DiscoverError> {
        let atoms = self.atoms(at, sight);
        let (p_value, first) = self.screened(at, sight, &atoms)?;
        let weighed = if p_value > ALPHA { None } else { Some(self.products(at, sight, first)?) };
        Ok(Begun { p_value, weighed, count: atoms.len() as f64, tried: Mutex::default() })
    }

    /// The atoms of the grammar, without those of single elements that take too much memory.
    fn atoms(&self, at: &Fitted, sight: &Sight) -> Vec<Atom> {
        let mut atoms = grammar::atoms(self.problem, at, sight, self.rounds);
        atoms.retain(|atom| !atom.of_elements || atom.columns(sight.elements) <= self.columns_most());
        atoms
    }

    /// The best atom of a field. Of those that are as good as the first the one is best that is so with as many knots as the evidence carries, and of
    /// those that act on the same by the same the one with the fewest numbers.
    fn best(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        field: &Field<'_>,
    ) -> Result<Option<Best>, DiscoverError> {
        let mut as_good = as_good_as_first(&field.ranked);
        let Some((first, _)) = as_good.first().copied() else { return Ok(None) };
        let mut alike = Vec::new();
        if as_good.iter().any(|(one, _)| !field.is_like(*one, first)) {
            let fine = |one: usize| form::finer(&field.weighed[one].atom, sight);
            let (of, atoms): (Vec<usize>, Vec<Atom>) =
                as_good.iter().flat_map(|(one, _)| fine(*one).into_iter().map(|atom| (*one, atom))).unzip();
            let ranked = self.ranked(at, sight, &atoms, field.begun.count)?;
            let first = of[ranked.first().map_or(0, |(place, _)| *place)];
            let as_fine: Vec<usize> =
                as_good_as_first(&ranked).into_iter().map(|(place, _)| of[place]).collect();
            alike.extend(as_fine.into_iter().filter(|one| !field.is_like(*one, first)));
            as_good.retain(|(one, _)| field.is_like(*one, first));
        }
        let mut alike: Vec<String> =
            alike.into_iter().map(|one| words::of_atom(&field.weighed[one].atom)).collect();
        alike.dedup();
        let best = as_good.into_iter().min_by_key(|(one, _)| field.weighed[*one].directions.len());
        Ok(best.map(|(atom, ln_odds)| Best { atom, ln_odds, alike }))
    }

    /// Atoms with the logarithm of the odds of each by itself, greatest first, as one of so many; in as many passes as they take.
    fn ranked(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atoms: &[Atom],
        count: f64,
    ) -> Result<Vec<(usize, f64)>, DiscoverError> {
        let mut found: Vec<(usize, f64)> = Vec::new();
        for some in self.in_passes(atoms, sight) {
            let first = found.len();
            let (weighed, grams) = self.products(at, sight, some.to_vec())?;
            let additions = additions(&weighed, &grams, count);
            let evidence = self.evidence_of(&additions, grams.reduced());
            found.extend(ranked(&evidence).into_iter().map(|(place, odds)| (first + place, odds)));
        }
        found.sort_by(|a, b| b.1.total_cmp(&a.1));
        Ok(found)
    }

    /// The best atom of a field as a draft.
    fn drafted(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        field: &Field<'_>,
        Best { atom: best, ln_odds, alike }: Best,
        (name, against): (&str, Against<'_>),
    ) -> Result<Outcome, DiscoverError> {
        let folds = self.folds(field, best);
        if folds < FOLDS_LEAST {
            return Ok(Err(NoDraft::Unsteady));
        }
        let nearest: Vec<(&'static str, f64)> =
            field.classes.iter().map(|(class, odds)| (*class, ln_odds - odds)).collect();
        let as_near = nearest.first().filter(|(_, behind)| *behind < AHEAD_LN_ODDS);
        if let (Some((class, _)), Against::Classes { .. }) = (as_near, against) {
            return Ok(Err(NoDraft::Class(class)));
        }
        let Some((AsEffect { draft, at: with, covariance, knots }, unseen_gains)) =
            self.tried(at, sight, field, best, name)?
        else {
            return Ok(Err(NoDraft::NoGain));
        };
        if let Against::Names { nearest, cost } = against
            && with.cost >= cost
        {
            return Ok(Err(NoDraft::Class(nearest)));
        }
        if unseen_gains.iter().sum::<f64>() <= 0.0 {
            return Ok(Err(NoDraft::Further));
        }
        if self.own_share(at, &with)? < OWN_LEAST {
            return Ok(Err(NoDraft::TakenUp));
        }
        let ln_odds = self.ln_odds(at, &with);
        if ln_odds < AHEAD_LN_ODDS {
            return Ok(Err(NoDraft::NoGain));
        }
        let numbers = covariance.len() + draft.weights.as_ref().map_or(0, Vec::len);
        let Begun { p_value, count, .. } = *field.begun;
        let ln_odds_as_chosen = self.ln_odds_of_numbers(at, &with, numbers) - count.ln();
        Ok(Ok(Box::new(Drafted {
            ln_odds_as_chosen,
            draft,
            at: with,
            covariance,
            knots,
            p_value,
            ln_odds,
            folds,
            unseen_gains,
            nearest,
            alike,
        })))
    }

    /// An atom of a field as an effect of this name: as it was tried before, if it was.
    fn tried(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        field: &Field<'_>,
        atom: usize,
        name: &str,
    ) -> Result<Unseen, DiscoverError> {
        let tried = || field.begun.tried.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |(known, _): &&((usize, String), Unseen)| (known.0, known.1.as_str()) == (atom, name);
        let known = tried().iter().find(is_it).map(|(_, found)| found.clone());
        if let Some(known) = known {
            return Ok(known);
        }
        let of = field.weighed[atom].atom.clone();
        let found = self.as_effect(at, sight, of, field.begun.count, name)?;
        tried().push(((atom, name.to_owned()), found.clone()));
        Ok(found)
    }

    /// Probability that noise gives as much to any atom, and the atoms that come first.
    fn screened(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atoms: &[Atom],
    ) -> Result<(f64, Vec<Atom>), DiscoverError> {
        let mut screened: Vec<Screened<'_>> = Vec::new();
        for some in self.in_passes(atoms, sight) {
            let columns: Vec<Sparse<'_>> = some.iter().map(|atom| sight.columns(atom)).collect();
            let numbers = in_a_row(0, some.iter().map(|atom| atom.columns(sight.elements)));
            let grams = Arc::new(self.problem.grams_of_each(at, columns)?);
            screened.extend(some.iter().zip(numbers).map(|(atom, own)| Screened {
                atom,
                own,
                grams: Arc::clone(&grams),
            }));
        }
        let score = |Screened { atom, own, grams }: &Screened<'_>| -> Vec<Score> {
            let is_there =
                |one: &usize| grams.size(*one) > 1e-3 * grams.whole(*one) && grams.size(*one) > 0.0;
            let of_each = own.clone().filter(is_there);
            of_each.map(|one| Score::of_grams(grams, &[one]).picked_from(atom.among)).collect()
        };
        let scores: Vec<Vec<Score>> = parallel::map(&screened, score);
        let groups: Vec<Vec<&Score>> = scores.iter().map(|of| of.iter().collect()).collect();
        let under_none = largest(&flipped(&groups, FLIPS, self.options.seed ^ STREAM));
        let statistic = scores.iter().flatten().map(|score| score.z).fold(0.0, f64::max);
        // Hats overlap, in all atoms alike.
        let strength = |scores: &[Score]| -> f64 {
            scores.iter().map(|score| score.z * score.z).sum::<f64>() - scores.len() as f64
        };
        let mut order: Vec<usize> = (0..atoms.len()).filter(|atom| !scores[*atom].is_empty()).collect();
        order.sort_by(|a, b| strength(&scores[*b]).total_cmp(&strength(&scores[*a])));
        order.truncate(WEIGHED_MAX);
        let mut columns = 0;
        order.retain(|place| {
            // Once it has a curve, an atom of single elements has a column for each.
            let of_elements = atoms[*place].of_elements;
            let own = if of_elements { sight.elements } else { atoms[*place].columns(sight.elements) };
            let fits = columns == 0 || columns + own <= self.parts_most();
            columns += if fits { own } else { 0 };
            fits
        });
        let first = order.into_iter().map(|place| {
            let Screened { atom, own, grams } = &screened[place];
            let atom = (*atom).clone();
            if atom.of_elements { sight.with_curve(atom, grams, own.clone()) } else { atom }
        });
        Ok((p_value(statistic, &under_none), first.collect()))
    }

    /// Atoms in the passes that they take, in order: in each as many as there is memory for, and one at least.
    fn in_passes<'a>(&self, atoms: &'a [Atom], sight: &Sight) -> Vec<&'a [Atom]> {
        let most = self.columns_most();
        let mut passes = Vec::new();
        let mut rest = atoms;
        while !rest.is_empty() {
            let mut columns = 0;
            let fits = |atom: &&Atom| {
                columns += atom.columns(sight.elements);
                columns <= most
            };
            let (some, others) = rest.split_at(rest.iter().take_while(fits).count().max(1));
            passes.push(some);
            rest = others;
        }
        passes
    }

    /// Columns of a pass for which there is memory.
    fn parts_most(&self) -> usize {
        let bins = self.problem.predictor.bins;
        PARTS_MAX / (bins.blocks.clamp(1, BLOCKS_MAX) * bins.elements)
    }

    /// Greatest number of columns of a pass that tests each by itself.
    fn columns_most(&self) -> usize {
        self.parts_most().min(COLUMNS_MAX)
    }

    /// The drafts that are not tried, because the array has too many elements.
    pub(crate) fn drafts_not_tried(&self) -> Option<NotShown> {
        let elements = self.problem.predictor.bins.elements;
        let (columns, most) = (KNOTS_OF_ELEMENTS * elements, self.columns_most());
        (columns > most).then(|| NotShown {
            effect: "a draft of single elements",
            reason: format!(
                "each of the {elements} elements would have {KNOTS_OF_ELEMENTS} values of its own; a pass over these data has memory for \
                 {most} values"
            ),
        })
    }

    /// The products of atoms: of each with itself and with the first.
    fn products(
        &self,
        at: &Fitted,
        sight: &Arc<Sight>,
        atoms: Vec<Atom>,
    ) -> Result<(Vec<Weighed>, Grams), DiscoverError> {
        let columns: Vec<Sparse<'_>> = atoms.iter().map(|atom| sight.columns(atom)).collect();
        let numbers = in_a_row(0, atoms.iter().map(|atom| atom.columns(sight.elements)));
        let of_atom = |(atom, numbers): (Atom, Range<usize>)| Weighed { atom, directions: numbers.collect() };
        let weighed = atoms.into_iter().zip(numbers).map(of_atom).collect();
        Ok((weighed, self.problem.grams(at, columns)?))
    }

    fn evidence_of<'a>(&self, additions: &'a [Addition], products: &'a DMatrix<f64>) -> Evidence<'a> {
        Evidence { additions, products, variance: self.problem.variance, present: &[] }
    }

    /// In how many folds of presses the best atom comes first or is as good as the first, by the presses that are not in the fold.
    fn folds(&self, field: &Field<'_>, best: usize) -> usize {
        let first_in = |fold: &usize| {
            let products = field.grams.without(*fold);
            let mut ranked = ranked(&self.evidence_of(field.additions, &products));
            ranked.retain(|(one, _)| field.ranked.iter().any(|(there, _)| there == one));
            as_good_as_first(&ranked).iter().any(|(one, _)| field.is_like(*one, best))
        };
        (0..FOLDS).filter(first_in).count()
    }

    /// The classes whose first step comes nearest, with the logarithm of their odds, but those that are refuted.
    fn classes(&self, at: &Fitted, against: Against<'_>) -> Result<Vec<(&'static str, f64)>, DiscoverError> {
        let pass = self.pass(at)?;
        let evidence = pass.evidence();
        let best = evidence.best_of_classes(&evidence.none(), &pass.among(|_| true), f64::NEG_INFINITY);
        let of = |(addition, gain): &(usize, Gain)| (pass.class_of(*addition), gain.ln_odds.max(0.0));
        let is_refuted =
            |class: &str| matches!(against, Against::Classes { refuted } if refuted.contains(&class));
        Ok(best.iter().map(of).filter(|(class, _)| !is_refuted(class)).take(3).collect())
    }

    /// How much of a draft, the last term of a model, is not taken up by recalibration and the other terms.
    fn own_share(&self, at: &Fitted, with: &Fitted) -> Result<f64, DiscoverError> {
        let Some(term) = with.parameters.terms.last() else { return Ok(0.0) };
        let start = at.parameters.with(Term::neutral(term.definition));
        let direction = self.problem.towards(&start, Free::Of { term: start.terms.len() - 1, parameter: 0 });
        let grams = self.problem.grams(at, vec![direction])?;
        Ok(grams.size(0) / grams.whole(0).max(f64::MIN_POSITIVE))
    }
}

/// The atoms as additions, each a class of its own.
fn additions(weighed: &[Weighed], grams: &Grams, count: f64) -> Vec<Addition> {
    let last = grams.reduced().nrows() - 1;
    let residual = grams.reduced()[(last, last)].sqrt();
    let of = |(class, one): (usize, &Weighed)| Addition {
        class,
        directions: one.directions.clone(),
        widths: vec![
            width(residual, one.directions.iter().map(|direction| grams.whole(*direction)));
            one.directions.len()
        ],
        signs: vec![Signs::Both; one.directions.len()],
        among: count * one.atom.among,
        is_free: false,
    };
    weighed.iter().enumerate().map(of).collect()
}

/// The width of all coefficients of an atom whose columns have these sizes: one, since they are values of one curve. An atom has no range, so
/// it is what would make the whole residual where that sees the curve most. With a width of its own, a knot that hardly any reading sees
/// could have any value.
fn width(residual: f64, sizes: impl Iterator<Item = f64>) -> f64 {
    residual / sizes.fold(f64::MIN_POSITIVE, f64::max)
}

/// Those that are behind the first by less than a draft must be ahead of a class.
fn as_good_as_first(ranked: &[(usize, f64)]) -> Vec<(usize, f64)> {
    let first = ranked.first().map_or(0.0, |(_, odds)| *odds);
    ranked.iter().copied().filter(|(_, odds)| *odds > first - AHEAD_LN_ODDS).collect()
}

/// The additions with the logarithm of their odds, greatest first.
fn ranked(evidence: &Evidence<'_>) -> Vec<(usize, f64)> {
    let numbers: Vec<usize> = (0..evidence.additions.len()).collect();
    let odds = parallel::map(&numbers, |one| evidence.gain_alone(*one).ln_odds);
    let mut ranked: Vec<(usize, f64)> = numbers.into_iter().zip(odds).collect();
    ranked.sort_by(|a, b| b.1.total_cmp(&a.1));
    ranked
}

#[cfg(test)]
#[path = "draft_tests.rs"]
mod tests;
