//! Content of the live view.

use ratatui::Frame;
use ratatui::layout::Rect;
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Gauge, Paragraph};
use tactus_live::{Entry, History, Log, Order, Weight, Zero};
use tactus_schema::{pb, with_message};

use super::image::{self, Image};
use super::place::{self, Place};
use super::traces::{Traces, intervals_s};
use crate::commands::control::fault_words;
use crate::output::duration;

/// Size from which on everything is shown of an array of 6 x 8.
const SHOWS_ALL: &str = "80x24 has all";

/// Least heights of the traces and of the log, borders included.
const TRACES_MIN: u16 = 6;
const LOG_MIN: u16 = 4;

/// What a key changes in the view.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Key {
    /// The cursor goes right and up by these.
    Move([isize; 2]),
    /// A trace of the element at the cursor, or no longer.
    Choose,
    /// Traces of the elements that are pressed most.
    Automatic,
    Longer,
    Shorter,
    /// The present frame is the zero of this view; again: the service's zero.
    Zero,
    /// Back in the log, and forth.
    Earlier,
    Later,
}

/// The latest state of everything that is shown.
pub(super) struct Screen {
    rig: String,
    rows: usize,
    cols: usize,
    frame: Option<pb::Frame>,
    lost: u64,
    history: History,
    zero: Zero,
    /// The zero of this view only.
    own_zero: Option<Vec<f32>>,
    description: Option<pb::RigDescription>,
    traces: Traces,
    cursor: usize,
    /// Log entries after the last one shown.
    later: usize,
    pub(super) log: Log,
    pub(super) stage: Option<pb::StageState>,
    pub(super) run: Option<pb::RunState>,
    pub(super) health: Option<pb::Health>,
    pub(super) alive: bool,
    pub(super) missed: u64,
    /// The answer to the last key; the next key removes it.
    pub(super) note: String,
}

/// Where everything stands. What has no room is left out.
struct Places {
    head: Rect,
    image: Option<(Rect, [u16; 2])>,
    place: Option<Rect>,
    run: Rect,
    traces: Option<Rect>,
    log: Option<Rect>,
    foot: Rect,
}

impl Screen {
    pub(super) fn new(rig: &str) -> Self {
        Self {
            rig: rig.to_owned(),
            rows: 0,
            cols: 0,
            frame: None,
            lost: 0,
            history: History::default(),
            zero: Zero::default(),
            own_zero: None,
            description: None,
            traces: Traces::default(),
            cursor: 0,
            later: 0,
            log: Log::default(),
            stage: None,
            run: None,
            health: None,
            alive: true,
            missed: 0,
            note: String::new(),
        }
    }

    pub(super) fn on_info(&mut self, info: &pb::SensorInfo) {
        self.rows = info.rows as usize;
        self.cols = info.cols as usize;
    }

    pub(super) fn on_description(&mut self, description: pb::RigDescription) {
        self.zero.describe(&description);
        self.description = Some(description);
    }

    pub(super) fn on_event(&mut self, event: &pb::RunEvent) {
        if self.log.on_event(event) {
            self.zero.on_event(event);
        }
    }

    pub(super) fn on_frame(&mut self, frame: pb::Frame) {
        let order = self.history.push(&frame, self.stage.as_ref());
        if order == Order::Again {
            return;
        }
        if self.zero.on_frame(&frame, order == Order::Restarted) {
            let text = "the sensor connected anew: the zero is void";
            self.log.note(frame.t_wall_ns, "sensor", Weight::Warning, text);
        }
        self.lost += u64::from(frame.lost_before);
        self.frame = Some(frame);
    }

    pub(super) fn on_key(&mut self, key: Key) {
        self.note.clear();
        match key {
            Key::Move([right, up]) => self.move_cursor(right, up),
            Key::Choose => self.traces.toggle(self.cursor),
            Key::Automatic => self.traces.choose_automatically(),
            Key::Longer => self.traces.lengthen(),
            Key::Shorter => self.traces.shorten(),
            Key::Zero => self.tare(),
            Key::Earlier => self.later = (self.later + 1).min(self.log.entries().len().saturating_sub(1)),
            Key::Later => self.later = self.later.saturating_sub(1),
        }
    }

    fn move_cursor(&mut self, right: isize, up: isize) {
        let (Some(row), Some(col)) = (self.cursor.checked_div(self.cols), self.cursor.checked_rem(self.cols))
        else {
            return;
        };
        let row = row.saturating_add_signed(up).min(self.rows.saturating_sub(1));
        let col = col.saturating_add_signed(right).min(self.cols - 1);
        self.cursor = row * self.cols + col;
    }

    /// Takes the present frame as the zero of this view, or gives up that zero.
    fn tare(&mut self) {
        if self.own_zero.take().is_some() {
            self.note = "the zero is the service's again".into();
        } else if let Some(frame) = &self.frame {
            self.own_zero = Some(frame.counts.clone());
            self.note = "the present frame is the zero of this view only; t again: the service's".into();
        }
    }

    /// The zero in force; zeros if none is known of this array.
    fn zero(&self) -> (Vec<f32>, bool) {
        let elements = self.frame.as_ref().map_or(0, |frame| frame.counts.len());
        let zero = self.own_zero.as_deref().unwrap_or_else(|| self.zero.counts());
        if zero.len() == elements { (zero.to_owned(), true) } else { (vec![0.0; elements], false) }
    }

    pub(super) fn draw(&self, frame: &mut Frame<'_>) {
        let places = self.places(frame.area());
        let (zero, has_zero) = self.zero();
        frame.render_widget(Paragraph::new(self.headline()), places.head);
        if let Some((area, cell)) = places.image {
            let counts = self.frame.as_ref().map_or(&[][..], |frame| &frame.counts);
            let rises: Vec<_> = counts.iter().zip(&zero).map(|(count, zero)| count - zero).collect();
            let image = Image {
                rows: self.rows,
                cols: self.cols,
                rises: &rises,
                has_zero,
                cursor: self.cursor,
                traced: &self.traces.elements(&self.history, &zero),
                bad: self.frame.as_ref().map_or(&[][..], |frame| &frame.bad_elements),
            };
            image.draw(frame, area, cell);
        }
        if let Some(area) = places.place {
            Place { stage: self.stage.as_ref(), rig: self.description.as_ref() }.draw(frame, area);
        }
        self.draw_run(frame, places.run);
        if let Some(area) = places.traces {
            self.traces.draw(frame, area, &self.history, &zero);
        }
        if let Some(area) = places.log {
            self.draw_log(frame, area);
        }
        frame.render_widget(Paragraph::new(self.foot(&places)), places.foot);
    }

    /// From the top: headline, image and stage, run, traces, log, keys.
    fn places(&self, area: Rect) -> Places {
        let mut rest = area;
        let mut take = |height: u16| {
            let taken = Rect { height: height.min(rest.height), ..rest };
            rest.y += taken.height;
            rest.height -= taken.height;
            taken
        };
        let fault = u16::from(self.fault().is_some());
        let run_height = 2 + fault;
        let head = take(1);
        let free = area.height.saturating_sub(2 + run_height);
        // Two fifths, so that traces and log have the rest; all of it where these have no room anyway.
        let height_max = if free < 8 + TRACES_MIN { free } else { (area.height * 2 / 5).max(8) };
        let (rows, cols) = (self.rows.max(1), self.cols.max(1));
        let beside = image::cell(rows, cols, area.width.saturating_sub(place::WIDTH_MIN), height_max);
        let cell = beside.or_else(|| image::cell(rows, cols, area.width, height_max));
        let (mut image, mut place) = (None, None);
        if let Some(cell) = cell {
            let [width, height] =
                image::size(rows, cols, cell).map(|length| u16::try_from(length).unwrap_or(u16::MAX));
            let band = take(height);
            image = Some((Rect { width, ..band }, cell));
            place = beside.map(|_| Rect { x: band.x + width, width: band.width - width, ..band });
        }
        let run = take(run_height);
        let free = rest_height(area, head, image, run).saturating_sub(1);
        let (traces, log) = if free >= TRACES_MIN + LOG_MIN {
            let traces = (free * 3 / 5).max(TRACES_MIN).min(free - LOG_MIN);
            (Some(take(traces)), Some(take(free - traces)))
        } else if free >= TRACES_MIN {
            (Some(take(free)), None)
        } else if free >= LOG_MIN {
            (None, Some(take(free)))
        } else {
            (None, None)
        };
        let foot = Rect { y: area.bottom().saturating_sub(1), height: area.height.min(1), ..area };
        Places { head, image, place, run, traces, log, foot }
    }

    fn headline(&self) -> Line<'static> {
        let red = Style::new().fg(Color::LightRed);
        let mut spans = vec![Span::styled(format!("rig {}", self.rig), Modifier::BOLD)];
        if self.frame.as_ref().is_some_and(|frame| frame.simulated) {
            spans.push(Span::styled("  SIMULATED", Style::new().fg(Color::Yellow)));
        }
        if !self.alive {
            spans.push(Span::styled("  SERVICE NOT READY", red));
        }
        let not_read = self.frame.as_ref().map_or(0, |frame| frame.bad_elements.len());
        if not_read > 0 {
            spans.push(Span::styled(format!("  {not_read} elements not read"), red));
        }
        let losses = format!("  {} lost at the device  {} missed here", self.lost, self.missed);
        spans.push(Span::styled(losses, if self.lost + self.missed > 0 { red } else { Style::new() }));
        let rate_hz = self.health.as_ref().map_or(0.0, |health| health.frame_rate_hz);
        spans.push(Span::raw(format!("  {rate_hz:.1} Hz")));
        if let Some([least_s, greatest_s]) = intervals_s(&self.history) {
            spans.push(Span::raw(format!("  {:.0} to {:.0} ms", least_s * 1e3, greatest_s * 1e3)));
        }
        if let Some(temperature_c) = self.frame.as_ref().and_then(|frame| frame.temperature_c) {
            spans.push(Span::raw(format!("  {temperature_c:.1} \u{b0}C")));
        }
        Line::from(spans)
    }

    /// What wants a reset.
    fn fault(&self) -> Option<&str> {
        self.run.as_ref().map(|run| run.fault.as_str()).filter(|fault| !fault.is_empty())
    }

    fn draw_run(&self, frame: &mut Frame<'_>, area: Rect) {
        let run = self.run.clone().unwrap_or_default();
        let bar = Rect { height: area.height.min(1), ..area };
        let share = f64::from(run.presses) / f64::from(run.presses_planned.max(1));
        let is_over =
            matches!(run.phase(), pb::RunPhase::Finished | pb::RunPhase::Idle | pb::RunPhase::Unspecified);
        let left = if run.remaining_s > 0.0 && !is_over {
            format!(", {} left", duration(run.remaining_s))
        } else {
            String::new()
        };
        let presses = format!("{}/{} presses{left}", run.presses, run.presses_planned);
        let gauge = Gauge::default().gauge_style(Style::new().fg(Color::Blue).bg(Color::DarkGray));
        frame.render_widget(gauge.ratio(share.clamp(0.0, 1.0)).label(presses), bar);
        let rest = Rect { y: area.y + bar.height, height: area.height - bar.height, ..area };
        frame.render_widget(Paragraph::new(self.run_lines(&run)), rest);
    }

    fn run_lines(&self, run: &pb::RunState) -> Vec<Line<'static>> {
        let mut words = match run.phase() {
            pb::RunPhase::Idle | pb::RunPhase::Unspecified => "no run since the service started".to_owned(),
            pb::RunPhase::Finished => {
                format!("run {}: {}", run.run_id, with_message(run.exit_status().word(), &run.message))
            }
            phase @ (pb::RunPhase::Preparing
            | pb::RunPhase::Running
            | pb::RunPhase::Paused
            | pb::RunPhase::Stopping) => {
                format!("run {}: {}", run.run_id, with_message(phase.word(), &run.message))
            }
        };
        if let Some(health) = self.health.as_ref().filter(|health| !health.lease_holder.is_empty()) {
            words = format!("{words}; {} holds the rig", health.lease_holder);
        }
        let mut lines = vec![Line::from(words)];
        if let Some(fault) = self.fault() {
            lines.push(Line::styled(format!("fault {}", fault_words(fault)), Style::new().fg(Color::Yellow)));
        }
        lines
    }

    /// The last entries, the newest at the bottom. Long ones take several lines.
    fn draw_log(&self, frame: &mut Frame<'_>, area: Rect) {
        let title = match self.later {
            0 => " log, UTC ".to_owned(),
            later => format!(" log, UTC; {later} later entries "),
        };
        let block = Block::bordered().title(title);
        let inner = block.inner(area);
        frame.render_widget(block, area);
        let mut lines: Vec<Line<'static>> = Vec::new();
        for entry in self.log.entries().rev().skip(self.later) {
            if lines.len() >= inner.height.into() {
                break;
            }
            lines.extend(logged(entry, inner.width.into()).into_iter().rev());
        }
        lines.truncate(inner.height.into());
        lines.reverse();
        frame.render_widget(Paragraph::new(lines), inner);
    }

    /// The answer to the last key, or the keys; and what has no room.
    fn foot(&self, places: &Places) -> Line<'static> {
        let smallest = image::smallest(self.rows, self.cols).map(|length| length.to_string()).join("x");
        let left_out: Vec<_> = [
            (places.image.is_none(), format!("image ({smallest})")),
            (places.place.is_none(), "stage".to_owned()),
            (places.traces.is_none(), "traces".to_owned()),
            (places.log.is_none(), "log".to_owned()),
        ]
        .into_iter()
        .filter_map(|(is_left_out, name)| is_left_out.then_some(name))
        .collect();
        let mut spans =
            if self.note.is_empty() { Vec::new() } else { vec![Span::raw(format!("{}  ", self.note))] };
        if !left_out.is_empty() {
            let text = format!("no room for {}: {SHOWS_ALL}  ", left_out.join(", "));
            spans.push(Span::styled(text, Style::new().fg(Color::Yellow)));
        }
        if self.note.is_empty() {
            let keys = "q quit  S STOP  arrows space a: traces  + - time  t zero  PgUp PgDn log";
            spans.push(Span::raw(keys));
        }
        Line::from(spans)
    }
}

/// Rows below headline, image and run.
fn rest_height(area: Rect, head: Rect, image: Option<(Rect, [u16; 2])>, run: Rect) -> u16 {
    let image = image.map_or(0, |(area, _)| area.height);
    area.height.saturating_sub(head.height + image + run.height)
}

/// An entry of the log in lines of at most this width: time, run, text.
fn logged(entry: &Entry, width: usize) -> Vec<Line<'static>> {
    let style = match entry.weight {
        Weight::Note => Style::new(),
        Weight::Warning => Style::new().fg(Color::Yellow),
        Weight::Stop => Style::new().fg(Color::LightRed),
    };
    let of_day_s = entry.t_wall_ns.div_euclid(1_000_000_000).rem_euclid(86_400);
    let time = format!("{:02}:{:02}:{:02}", of_day_s / 3600, of_day_s / 60 % 60, of_day_s % 60);
    let run = if entry.run_id.is_empty() { String::new() } else { format!("{} ", entry.run_id) };
    let text = format!("{time} {run}{}: {}", entry.kind, entry.text);
    wrapped(&text, width, time.len() + 1).into_iter().map(|line| Line::styled(line, style)).collect()
}

/// Text in lines of at most this width, all but the first indented. Words longer than a line are cut.
fn wrapped(text: &str, width: usize, indent: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= width => {
                line.push(' ');
                line.push_str(word);
            }
            Some(_) => lines.push(format!("{}{word}", " ".repeat(indent))),
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
#[path = "screen_tests.rs"]
mod tests;
