//! The pressure image: each element at its place.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style, Stylize};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Paragraph};

use super::traces;

/// Sizes of an element's cell in characters, the best first. The smallest shows a colour and no number.
const CELLS: [[u16; 2]; 4] = [[10, 3], [7, 2], [7, 1], [3, 1]];

/// Least span of the colour scale, in counts, so that noise does not look like a press.
const SPAN_MIN_COUNTS: f32 = 100.0;

/// What the image shows. Elements are row-major.
pub(super) struct Image<'a> {
    pub(super) rows: usize,
    pub(super) cols: usize,
    /// Rises above the zero; counts if no zero is known.
    pub(super) rises: &'a [f32],
    pub(super) has_zero: bool,
    pub(super) cursor: usize,
    /// Elements with a trace, in the order of their colours.
    pub(super) traced: &'a [usize],
    pub(super) bad: &'a [u32],
}

/// The largest cell with which an array's image fits, its border included; `None` if none does.
pub(super) fn cell(rows: usize, cols: usize, width_max: u16, height_max: u16) -> Option<[u16; 2]> {
    CELLS.into_iter().find(|cell| {
        let [width, height] = size(rows, cols, *cell);
        width <= width_max.into() && height <= height_max.into()
    })
}

/// Width and height of an image with its border.
pub(super) fn size(rows: usize, cols: usize, [width, height]: [u16; 2]) -> [usize; 2] {
    [
        cols.saturating_mul(width.into()).saturating_add(2),
        rows.saturating_mul(height.into()).saturating_add(2),
    ]
}

/// Width and height of the smallest image, border included.
pub(super) fn smallest(rows: usize, cols: usize) -> [usize; 2] {
    size(rows, cols, CELLS[CELLS.len() - 1])
}

impl Image<'_> {
    /// Draws it with row 0 at the bottom, because y points up.
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect, cell: [u16; 2]) {
        let title = if self.has_zero { " counts above zero " } else { " counts; no zero is known " };
        let block = Block::bordered().title(title);
        let inner = block.inner(area);
        frame.render_widget(block, area);
        if self.rises.is_empty() || self.rows == 0 || self.cols == 0 {
            frame.render_widget(Paragraph::new("waiting for frames"), inner);
            return;
        }
        let span = self.rises.iter().copied().fold(SPAN_MIN_COUNTS, f32::max);
        for (element, &rise) in self.rises.iter().enumerate().take(self.rows * self.cols) {
            let (row, col) = (element / self.cols, element % self.cols);
            let place =
                u16::try_from(col).ok().zip(u16::try_from(self.rows - 1 - row).ok()).map(|(right, down)| {
                    let [width, height] = cell;
                    Rect::new(inner.x + right * width, inner.y + down * height, width, height)
                        .intersection(inner)
                });
            if let Some(place) = place.filter(|place| !place.is_empty()) {
                frame.render_widget(self.element(element, rise, rise / span, cell), place);
            }
        }
    }

    /// The cell of an element: its mark, its number where there is room, its rise.
    fn element(
        &self,
        element: usize,
        rise: f32,
        share: f32,
        [width, height]: [u16; 2],
    ) -> Paragraph<'static> {
        let (back, fore) = colours(share);
        let is_bad = self.bad.iter().any(|&bad| bad as usize == element);
        let value = if is_bad { "?".to_owned() } else { format!("{rise:.0}") };
        let room = usize::from(width).saturating_sub(3);
        let (left, right) = if element == self.cursor { ("[", "]") } else { (" ", " ") };
        let mark = match self.traced.iter().position(|&traced| traced == element) {
            Some(trace) => Span::styled("●", Style::new().fg(traces::colour(trace))),
            None => Span::raw(" "),
        };
        let framed = |text: String| {
            let mut spans = vec![Span::raw(left), Span::raw(text), Span::raw(right)];
            if element == self.cursor {
                spans = spans.into_iter().map(Stylize::bold).collect();
            }
            spans
        };
        let lines = if room == 0 {
            vec![Line::from([vec![mark], framed(String::new())].concat())]
        } else if height == 1 {
            vec![Line::from([vec![mark], framed(format!("{value:^room$}"))].concat())]
        } else {
            let number = Line::from(vec![mark, Span::styled(element.to_string(), Modifier::ITALIC)]);
            vec![number, Line::from([vec![Span::raw(" ")], framed(format!("{value:^room$}"))].concat())]
        };
        Paragraph::new(lines).style(Style::new().bg(back).fg(fore))
    }
}

/// Background colour (dark blue to yellow) for a share of the span, and a readable text colour.
fn colours(share: f32) -> (Color, Color) {
    // Five anchors of the viridis map (van der Walt and Smith, 2015, CC0).
    const ANCHORS: [[f32; 3]; 5] = [
        [68.0, 1.0, 84.0],
        [59.0, 82.0, 139.0],
        [33.0, 145.0, 140.0],
        [94.0, 201.0, 98.0],
        [253.0, 231.0, 37.0],
    ];
    let place = share.clamp(0.0, 1.0) * 4.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "0 to 3, clamped above")]
    let low = (place.floor() as usize).min(3);
    let part = place - low as f32;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between two colour bytes")]
    let mix = |channel: usize| {
        let [from, to] = [ANCHORS[low][channel], ANCHORS[low + 1][channel]];
        (from + (to - from) * part) as u8
    };
    (Color::Rgb(mix(0), mix(1), mix(2)), if share > 0.6 { Color::Black } else { Color::White })
}
