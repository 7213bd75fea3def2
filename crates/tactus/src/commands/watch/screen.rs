//! Content of the live view.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::text::{Line, Span};
use ratatui::widgets::{Block, Gauge, Paragraph};
use tactus_schema::pb;

use crate::commands::control::fault_words;
use crate::output::duration;

/// Width and height of an element's cell, in characters.
const CELL: [u16; 2] = [7, 2];

/// Least span of the colour scale, in counts, so that noise does not look like a press.
const SPAN_MIN_COUNTS: f32 = 100.0;

/// The latest state of everything that is shown.
pub(super) struct Screen {
    rig: String,
    rows: usize,
    cols: usize,
    frame: Option<pb::Frame>,
    zero_counts: Vec<f32>,
    frames: u64,
    lost: u64,
    pub(super) stage: Option<pb::StageState>,
    pub(super) run: Option<pb::RunState>,
    pub(super) safety: Option<pb::SafetyEvent>,
    pub(super) health: Option<pb::Health>,
    pub(super) alive: bool,
    pub(super) missed: u64,
    pub(super) note: String,
}

impl Screen {
    pub(super) fn new(rig: &str) -> Self {
        Self {
            rig: rig.to_owned(),
            rows: 0,
            cols: 0,
            frame: None,
            zero_counts: Vec::new(),
            frames: 0,
            lost: 0,
            stage: None,
            run: None,
            safety: None,
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

    pub(super) fn on_frame(&mut self, frame: pb::Frame) {
        self.frames += 1;
        self.lost += u64::from(frame.lost_before);
        if self.zero_counts.len() != frame.counts.len() {
            self.zero_counts.clone_from(&frame.counts);
        }
        self.frame = Some(frame);
    }

    /// Takes the present frame as the zero of the view.
    pub(super) fn tare(&mut self) {
        if let Some(frame) = &self.frame {
            self.zero_counts.clone_from(&frame.counts);
            self.note = "tared (this view only)".into();
        }
    }

    pub(super) fn draw(&self, frame: &mut Frame<'_>) {
        let rows = u16::try_from(self.rows).unwrap_or(u16::MAX);
        let image_height = rows.saturating_mul(CELL[1]).saturating_add(2);
        let [head, image, run, foot] = Layout::vertical([
            Constraint::Length(1),
            Constraint::Length(image_height.max(4)),
            Constraint::Min(7),
            Constraint::Length(1),
        ])
        .areas(frame.area());
        frame.render_widget(Paragraph::new(self.headline()), head);
        self.draw_image(frame, image);
        self.draw_run(frame, run);
        frame.render_widget(Paragraph::new(format!("q quit   t tare view   S STOP   {}", self.note)), foot);
    }

    fn headline(&self) -> Line<'static> {
        let simulated = self.frame.as_ref().is_some_and(|frame| frame.simulated);
        let mut spans = vec![Span::styled(format!("tactus  rig {}", self.rig), Modifier::BOLD)];
        if simulated {
            spans.push(Span::styled("  SIMULATED", Style::new().fg(Color::Yellow)));
        }
        if !self.alive {
            spans.push(Span::styled("  SERVICE NOT READY", Style::new().fg(Color::Red)));
        }
        let not_read = self.frame.as_ref().map_or(0, |frame| frame.bad_elements.len());
        if not_read > 0 {
            spans.push(Span::styled(format!("  {not_read} elements not read"), Style::new().fg(Color::Red)));
        }
        let rate_hz = self.health.as_ref().map_or(0.0, |health| health.frame_rate_hz);
        spans.push(Span::raw(format!(
            "  {rate_hz:.1} Hz  {} frames  {} lost at the device  {} missed here",
            self.frames, self.lost, self.missed
        )));
        Line::from(spans)
    }

    /// Row 0 is at the bottom, because y points up.
    fn draw_image(&self, frame: &mut Frame<'_>, area: Rect) {
        let block = Block::bordered().title(" counts above zero ");
        let inner = block.inner(area);
        frame.render_widget(block, area);
        let (Some(latest), true) = (&self.frame, self.rows > 0 && self.cols > 0) else {
            frame.render_widget(Paragraph::new("waiting for frames"), inner);
            return;
        };
        let rises: Vec<_> =
            latest.counts.iter().zip(&self.zero_counts).map(|(count, zero)| count - zero).collect();
        let span = rises.iter().copied().fold(SPAN_MIN_COUNTS, f32::max);
        for (index, rise) in rises.iter().enumerate().take(self.rows * self.cols) {
            let (row, col) = (index / self.cols, index % self.cols);
            let cell =
                u16::try_from(col).ok().zip(u16::try_from(self.rows - 1 - row).ok()).map(|(right, down)| {
                    Rect::new(inner.x + right * CELL[0], inner.y + down * CELL[1], CELL[0], CELL[1])
                        .intersection(inner)
                });
            if let Some(cell) = cell.filter(|cell| !cell.is_empty()) {
                let (back, fore) = colours(rise / span);
                frame.render_widget(
                    Paragraph::new(format!("{rise:^6.0}")).style(Style::new().bg(back).fg(fore)),
                    cell,
                );
            }
        }
    }

    fn draw_run(&self, frame: &mut Frame<'_>, area: Rect) {
        let [bar, rest] = Layout::vertical([Constraint::Length(1), Constraint::Min(1)]).areas(area);
        let run = self.run.clone().unwrap_or_default();
        let share = f64::from(run.presses) / f64::from(run.presses_planned.max(1));
        let left = if run.remaining_s > 0.0 {
            format!(", {} left", duration(run.remaining_s))
        } else {
            String::new()
        };
        frame.render_widget(
            Gauge::default()
                .gauge_style(Color::Cyan)
                .ratio(share.clamp(0.0, 1.0))
                .label(format!("{}/{} presses{left}", run.presses, run.presses_planned)),
            bar,
        );
        frame.render_widget(Paragraph::new(self.lines(&run)), rest);
    }

    fn lines(&self, run: &pb::RunState) -> Vec<Line<'static>> {
        let ended = if run.phase() == pb::RunPhase::Finished {
            format!(": {}", run.exit_status().word())
        } else {
            String::new()
        };
        let mut lines = vec![
            Line::from(format!("run     {} {}{ended} {}", run.run_id, run.phase().word(), run.message)),
            Line::from(format!("frames  {} received, {} lost in this run", run.frames, run.frames_lost)),
        ];
        if let Some(stage) = &self.stage {
            lines.push(Line::from(format!(
                "stage   {}  x {:.3}  y {:.3}  z {:+.3} mm",
                stage.status().word(),
                stage.x_mm,
                stage.y_mm,
                stage.z_mm
            )));
        }
        if !run.fault.is_empty() {
            let text = format!("fault   {}", fault_words(&run.fault));
            lines.push(Line::styled(text, Style::new().fg(Color::Yellow)));
        }
        if let Some(event) = &self.safety {
            let stopped = event.verdict() == pb::SafetyVerdict::Stopped;
            let style = if stopped { Style::new().fg(Color::Red) } else { Style::new() };
            lines.push(Line::styled(format!("safety  {}: {}", event.rule, event.detail), style));
        }
        lines
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

#[cfg(test)]
#[path = "screen_tests.rs"]
mod tests;
