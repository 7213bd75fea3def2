//! All figures on one page that loads nothing.

use super::{Drawing, FIGURES};
use crate::{markup::Text, plot};

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
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n\
         <title>The paper's figures</title>\n<style>\n{}{}</style>\n</head>\n<body>\n<main>\n<header>\n\
         <div class=\"headline\"><h1>The paper's figures</h1><span class=\"badge warn\">SIMULATED</span></div>\n\
         <p class=\"under\">Characterization and simulation of tactile sensors, drawn again from the model. No physical \
         sensor was read: where the paper shows one, a virtual sensor stands in.</p>\n</header>\n{}</main>\n</body>\n</html>\n",
        plot::STYLE,
        include_str!("../page/page.css"),
        sections.concat()
    )
}
