//! A page of all figures.

use super::{Drawing, FIGURES};
use crate::{
    document::{SIMULATED_BADGE, document},
    markup::Text,
};

pub(super) fn page(drawings: &[Drawing]) -> String {
    let sections: Vec<String> = FIGURES
        .iter()
        .zip(drawings)
        .map(|(figure, drawing)| {
            format!(
                "<section>\n<h2>Figure {}. {}</h2>\n<p class=\"lead\">{}</p>\n{}\n</section>\n",
                figure.number,
                Text(figure.title),
                Text(&drawing.caption),
                drawing.sheet
            )
        })
        .collect();
    let header = format!(
        "<header>\n<div class=\"headline\"><h1>The paper's figures</h1>{SIMULATED_BADGE}</div>\n\
         <p class=\"under\">Characterization and Simulation of Tactile Sensors, computed from the model. No physical \
         sensor was read; a virtual sensor replaces the paper's.</p>\n</header>\n"
    );
    document("The paper's figures", header + &sections.concat())
}
