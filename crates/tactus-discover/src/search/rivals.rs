//! Rivals without a name: dependences that no effect of the library is, and that a name must beat.
//!
//! Each is a group of columns with free coefficients. None is modelled after a known physics: a factor of the sum of all signals, a map
//! over place, a dependence on the place within an element, on the side from which the tool came, an offset of each element in contact.

use std::ops::Range;
use std::sync::Arc;

use super::covariates::{Factor, Feature, Form, Forms, features};
use crate::data::DiscoverError;
use crate::fit::{Direction, Fitted, Problem};

/// Which covariates and forms of dependence belong to a rival.
const RIVALS: [(&str, &[&str], &[Form]); 5] = [
    ("sum of signals", &["sum of signals"], &[Form::Signal]),
    ("place", &["place along x", "place along y"], &[Form::Signal]),
    ("place in the element", &["place in the element along x", "place in the element along y"], &[
        Form::Signal,
    ]),
    (
        "direction of approach",
        &["direction of approach along x", "direction of approach along y"],
        &[Form::Signal, Form::AlongX, Form::AlongY],
    ),
    ("speed of travel", &["speed of travel"], &[Form::Offset]),
];
/// The rival that has an offset of each element in contact.
const CONTACT: &str = "contact";

/// A rival and its columns.
pub(crate) struct Rival {
    pub(crate) name: &'static str,
    pub(crate) columns: Vec<Direction<'static>>,
}

/// The rivals at a model.
pub(crate) fn rivals(problem: &Problem<'_>, at: &Fitted) -> Result<Vec<Rival>, DiscoverError> {
    let forms = Arc::new(Forms::of(problem, &at.parameters, &at.predicted)?);
    let elements = problem.predictor.bins.elements;
    let all = features(problem, &forms);
    let column = |feature: Feature| -> Direction<'static> {
        let forms = Arc::clone(&forms);
        Direction::Column(Box::new(move |bins: Range<usize>| forms.values(&feature, bins, elements)))
    };
    let mut found: Vec<Rival> = Vec::new();
    for (name, covariates, kinds) in RIVALS {
        let of_rival =
            all.iter().filter(|one| covariates.contains(&one.covariate) && kinds.contains(&one.form));
        found.push(Rival { name, columns: of_rival.cloned().map(column).collect() });
    }
    let deep = Arc::new(forms.deep());
    let of_element = |element: usize| {
        column(Feature {
            covariate: CONTACT,
            unit: "",
            form: Form::Offset,
            range: [0.0, 0.0],
            factor: Factor::Element(element, Arc::clone(&deep)),
        })
    };
    found.push(Rival { name: CONTACT, columns: (0..elements).map(of_element).collect() });
    found.retain(|rival| !rival.columns.is_empty());
    Ok(found)
}
