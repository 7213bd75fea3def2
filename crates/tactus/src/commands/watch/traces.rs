//! Traces: the rise of elements over the last seconds.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType};
use tactus_live::History;

/// Colours of traces, and so the greatest number of them.
const COLOURS: [Color; 6] =
    [Color::Cyan, Color::Yellow, Color::LightMagenta, Color::LightGreen, Color::LightRed, Color::White];

/// Traces that are shown if nobody chooses.
const AUTOMATIC: usize = 4;

/// Least span of the axis, in counts.
const SPAN_MIN_COUNTS: f64 = 100.0;

/// Lengths of time that can be shown, in s.
const WINDOWS_S: [u32; 4] = [5, 10, 30, 60];

/// Which elements have a trace, and how far back it goes.
#[derive(Debug)]
pub(super) struct Traces {
    /// Empty: those that were pressed most.
    chosen: Vec<usize>,
    /// An index of [`WINDOWS_S`].
    window: usize,
}

impl Default for Traces {
    fn default() -> Self {
        Self { chosen: Vec::new(), window: 1 }
    }
}

/// Colour of a trace by its place in the list.
pub(super) fn colour(trace: usize) -> Color {
    COLOURS[trace % COLOURS.len()]
}

impl Traces {
    /// Draws the trace of an element, or no longer. The oldest goes if there are too many.
    pub(super) fn toggle(&mut self, element: usize) {
        if let Some(at) = self.chosen.iter().position(|&chosen| chosen == element) {
            self.chosen.remove(at);
        } else {
            if self.chosen.len() == COLOURS.len() {
                self.chosen.remove(0);
            }
            self.chosen.push(element);
        }
    }

    /// Draws the elements that were pressed most.
    pub(super) fn choose_automatically(&mut self) {
        self.chosen.clear();
    }

    pub(super) fn lengthen(&mut self) {
        self.window = (self.window + 1).min(WINDOWS_S.len() - 1);
    }

    pub(super) fn shorten(&mut self) {
        self.window = self.window.saturating_sub(1);
    }

    fn window_s(&self) -> f64 {
        WINDOWS_S[self.window].into()
    }

    /// The elements with a trace, in the order of their colours.
    pub(super) fn elements(&self, history: &History, zero: &[f32]) -> Vec<usize> {
        if !self.chosen.is_empty() {
            return self.chosen.clone();
        }
        let mut greatest = vec![0.0_f32; zero.len()];
        for (_, counts) in self.moments(history) {
            for ((greatest, count), zero) in greatest.iter_mut().zip(counts).zip(zero) {
                *greatest = greatest.max((count - zero).abs());
            }
        }
        let mut elements: Vec<_> = (0..greatest.len()).collect();
        elements.sort_by(|&a, &b| greatest[b].total_cmp(&greatest[a]));
        elements.truncate(AUTOMATIC);
        // Colours do not change places while two elements are alike.
        elements.sort_unstable();
        elements
    }

    /// Times before the last frame, in s, at most 0, and counts.
    fn moments<'a>(&self, history: &'a History) -> impl Iterator<Item = (f64, &'a [f32])> + use<'a> {
        let last_s = history.moments().next_back().map_or(0.0, |moment| moment.t_s);
        let window_s = self.window_s();
        let moments =
            history.moments().rev().map(move |moment| (moment.t_s - last_s, moment.counts.as_slice()));
        moments.take_while(move |(t_s, _)| *t_s >= -window_s)
    }

    /// Draws them; the title has their colours and present rises.
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect, history: &History, zero: &[f32]) {
        let elements = self.elements(history, zero);
        let lines: Vec<Vec<Vec<(f64, f64)>>> =
            elements.iter().map(|&element| self.pieces(history, zero, element)).collect();
        let rises = lines.iter().flatten().flatten().map(|point| point.1);
        let low = rises.clone().fold(0.0, f64::min);
        let high = rises.fold(low + SPAN_MIN_COUNTS, f64::max);
        let window_s = self.window_s();
        let mut title = vec![Span::raw(format!(" rise above zero, {window_s:.0} s, counts "))];
        for (trace, (element, pieces)) in elements.iter().zip(&lines).enumerate() {
            let now = pieces.last().and_then(|piece| piece.last()).map_or(0.0, |point| point.1);
            title.push(Span::styled(format!(" ● {element}: {now:.0} "), Style::new().fg(colour(trace))));
        }
        let datasets = lines.iter().enumerate().flat_map(|(trace, pieces)| {
            pieces.iter().map(move |piece| {
                Dataset::default()
                    .marker(Marker::Braille)
                    .graph_type(GraphType::Line)
                    .style(Style::new().fg(colour(trace)))
                    .data(piece)
            })
        });
        let chart = Chart::new(datasets.collect())
            .block(Block::bordered().title(Line::from(title)))
            .x_axis(
                Axis::default()
                    .bounds([-window_s, 0.0])
                    .labels([format!("-{window_s:.0} s"), "now".to_owned()]),
            )
            .y_axis(Axis::default().bounds([low, high]).labels([format!("{low:.0}"), format!("{high:.0}")]));
        frame.render_widget(chart, area);
    }

    /// The trace of an element, in pieces between which frames were lost.
    fn pieces(&self, history: &History, zero: &[f32], element: usize) -> Vec<Vec<(f64, f64)>> {
        let Some(&zero) = zero.get(element) else { return Vec::new() };
        let mut pieces = vec![Vec::new()];
        let last_s = history.moments().next_back().map_or(0.0, |moment| moment.t_s);
        for moment in history.moments() {
            let t_s = moment.t_s - last_s;
            if t_s < -self.window_s() {
                continue;
            }
            if moment.lost_before > 0 {
                pieces.push(Vec::new());
            }
            if let (Some(piece), Some(counts)) = (pieces.last_mut(), moment.counts.get(element)) {
                piece.push((t_s, f64::from(counts - zero)));
            }
        }
        pieces
    }
}

/// Least and greatest time between frames of the last seconds, in s; `None` if there are fewer than two.
pub(super) fn intervals_s(history: &History) -> Option<[f64; 2]> {
    let last_s = history.moments().next_back()?.t_s;
    let recent = history.moments().rev().take_while(|moment| moment.t_s >= last_s - 5.0);
    let mut after: Option<f64> = None;
    let mut range: Option<[f64; 2]> = None;
    for moment in recent {
        if let Some(after_s) = after.replace(moment.t_s) {
            let interval_s = after_s - moment.t_s;
            let [least, greatest] = range.unwrap_or([interval_s; 2]);
            range = Some([least.min(interval_s), greatest.max(interval_s)]);
        }
    }
    range
}
