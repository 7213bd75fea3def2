//! Where the tip is: in numbers with the limits, from above, and in section.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Style};
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::canvas::{Canvas, Context, Line as Stroke, Points, Rectangle};
use ratatui::widgets::{Block, Paragraph};
use tactus_schema::pb;

/// Width of the numbers with their border.
pub(super) const WIDTH_MIN: u16 = 22;

/// Least width and height of a picture without its border.
const PICTURE_MIN: [u16; 2] = [16, 6];

const LIMIT: Style = Style::new().fg(Color::LightRed);
const TIP: Color = Color::White;

/// The stage, and the rig with its limits; each may be unknown yet.
pub(super) struct Place<'a> {
    pub(super) stage: Option<&'a pb::StageState>,
    pub(super) rig: Option<&'a pb::RigDescription>,
}

impl Place<'_> {
    pub(super) fn draw(&self, frame: &mut Frame<'_>, area: Rect) {
        let block = Block::bordered().title(" stage, mm ");
        let inner = block.inner(area);
        frame.render_widget(block, area);
        let numbers_width = WIDTH_MIN - 2;
        let [width, height] = PICTURE_MIN;
        let has_pictures = inner.width > numbers_width + 2 * width && inner.height >= height;
        let (Some(stage), Some(rig), true) = (self.stage, self.rig, has_pictures) else {
            frame.render_widget(Paragraph::new(self.numbers()), inner);
            return;
        };
        let [numbers, above, section] =
            Layout::horizontal([Constraint::Length(numbers_width), Constraint::Fill(1), Constraint::Fill(1)])
                .spacing(1)
                .areas(inner);
        frame.render_widget(Paragraph::new(self.numbers()), numbers);
        from_above(frame, above, stage, rig);
        in_section(frame, section, stage, rig);
    }

    fn numbers(&self) -> Vec<Line<'static>> {
        let Some(stage) = self.stage else { return vec!["unknown".into()] };
        let status = match stage.status() {
            pb::StageStatus::Unhomed => "not homed: `reset`".to_owned(),
            status @ (pb::StageStatus::Unspecified
            | pb::StageStatus::Disconnected
            | pb::StageStatus::Idle
            | pb::StageStatus::Moving
            | pb::StageStatus::Hold
            | pb::StageStatus::Homing
            | pb::StageStatus::Alarm) => status.word().to_owned(),
        };
        let mut lines = vec![Line::from(status)];
        let Some(rig) = self.rig else {
            lines.extend(
                [("x", stage.x_mm), ("y", stage.y_mm), ("z", stage.z_mm)]
                    .map(|(axis, mm)| Line::from(format!("{axis} {mm:7.3}"))),
            );
            return lines;
        };
        for (axis, mm, limits) in [("x", stage.x_mm, &rig.x_mm), ("y", stage.y_mm, &rig.y_mm)] {
            if let [from, to] = limits[..] {
                lines.push(limited(format!("{axis} {mm:7.3} {from}..{to}"), (from..=to).contains(&mm)));
            }
        }
        let is_low_enough = stage.z_mm <= rig.z_max_mm;
        lines.push(limited(format!("z {:7.3} to {}", stage.z_mm, rig.z_max_mm), is_low_enough));
        let depth_mm = (-stage.z_mm).max(0.0);
        lines.push(limited(
            format!("depth {depth_mm:.3}/{:.3}", rig.depth_max_mm),
            depth_mm <= rig.depth_max_mm,
        ));
        lines.push(Line::from(format!("covering {}", rig.covering_mm)));
        lines.push(Line::from(format!("tip {} {}", rig.indenter_shape, rig.indenter_width_mm)));
        lines
    }
}

/// Red outside the limits.
fn limited(text: String, is_inside: bool) -> Line<'static> {
    Line::styled(text, if is_inside { Style::new() } else { LIMIT })
}

/// Bounds of a picture around a place, true to scale: a Braille dot is as wide as it is high.
fn bounds(area: Rect, x_mm: [f64; 2], y_mm: [f64; 2]) -> [[f64; 2]; 2] {
    let dots = [f64::from(area.width) * 2.0, f64::from(area.height) * 4.0];
    let spans = [x_mm[1] - x_mm[0], y_mm[1] - y_mm[0]];
    let mm_per_dot = (spans[0] / dots[0]).max(spans[1] / dots[1]).max(f64::MIN_POSITIVE);
    let around = |[from, to]: [f64; 2], dots: f64| {
        let (centre, half) = (f64::midpoint(from, to), mm_per_dot * dots / 2.0);
        [centre - half, centre + half]
    };
    [around(x_mm, dots[0]), around(y_mm, dots[1])]
}

/// The envelope, the array and the tip; robot frame, y upwards.
fn from_above(frame: &mut Frame<'_>, area: Rect, stage: &pb::StageState, rig: &pb::RigDescription) {
    let (&[x0, x1], &[y0, y1]) = (&rig.x_mm[..], &rig.y_mm[..]) else { return };
    let corners = array_corners(rig);
    let [x_bounds, y_bounds] = bounds(area, [x0, x1], [y0, y1]);
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds(x_bounds).y_bounds(y_bounds).paint(|draw| {
            draw.draw(&Rectangle { x: x0, y: y0, width: x1 - x0, height: y1 - y0, color: Color::LightRed });
            for (index, from) in corners.iter().enumerate() {
                stroke(draw, *from, corners[(index + 1) % corners.len()], Color::DarkGray);
            }
            draw.layer();
            draw.print(x0, y0, Line::styled("limits", LIMIT));
            draw.print(stage.x_mm.clamp(x0, x1), stage.y_mm.clamp(y0, y1), Line::styled("◉", TIP));
        });
    frame.render_widget(canvas, area);
}

/// The covering along x through the tip: heights with their limits.
fn in_section(frame: &mut Frame<'_>, area: Rect, stage: &pb::StageState, rig: &pb::RigDescription) {
    let half_mm = (rig.indenter_width_mm / 2.0).max(0.2);
    let top_mm = rig.safe_height_mm.max(rig.covering_mm / 2.0);
    let [x_bounds, z_bounds] = bounds(area, [-half_mm, half_mm], [-1.1 * rig.covering_mm, top_mm]);
    let is_above = stage.z_mm > z_bounds[1];
    let tip_z_mm = stage.z_mm.min(z_bounds[1]);
    let canvas =
        Canvas::default().marker(Marker::Braille).x_bounds(x_bounds).y_bounds(z_bounds).paint(|draw| {
            let level = |draw: &mut Context<'_>, z_mm: f64, colour: Color| {
                stroke(draw, [x_bounds[0], z_mm], [x_bounds[1], z_mm], colour);
            };
            level(draw, 0.0, Color::Gray);
            level(draw, -rig.covering_mm, Color::DarkGray);
            level(draw, -rig.depth_max_mm, Color::LightRed);
            stroke(draw, [-half_mm, tip_z_mm], [half_mm, tip_z_mm], TIP);
            for x_mm in [-half_mm, half_mm] {
                stroke(draw, [x_mm, tip_z_mm], [x_mm, z_bounds[1]], TIP);
            }
            draw.draw(&Points { coords: &[(0.0, tip_z_mm)], color: TIP });
            draw.layer();
            draw.print(x_bounds[0], 0.0, "surface");
            draw.print(x_bounds[0], -rig.depth_max_mm, Line::styled("limit", LIMIT));
            draw.print(x_bounds[0], -rig.covering_mm, "sensor");
            if is_above {
                draw.print(0.0, z_bounds[1], Line::styled("↑ tip", TIP));
            }
        });
    frame.render_widget(canvas, area);
}

fn stroke(draw: &mut Context<'_>, [x1, y1]: [f64; 2], [x2, y2]: [f64; 2], color: Color) {
    draw.draw(&Stroke { x1, y1, x2, y2, color });
}

/// Corners of the array in the robot frame; none if the rig does not tell its places.
fn array_corners(rig: &pb::RigDescription) -> Vec<[f64; 2]> {
    let (Some((&left, &right)), Some((&bottom, &top))) = (
        rig.col_centres_mm.first().zip(rig.col_centres_mm.last()),
        rig.row_centres_mm.first().zip(rig.row_centres_mm.last()),
    ) else {
        return Vec::new();
    };
    let (&[width, height], &[origin_x, origin_y]) = (&rig.element_mm[..], &rig.origin_mm[..]) else {
        return Vec::new();
    };
    let (sin, cos) = rig.rotation_deg.to_radians().sin_cos();
    let corners = [
        (left, bottom, -1.0, -1.0),
        (right, bottom, 1.0, -1.0),
        (right, top, 1.0, 1.0),
        (left, top, -1.0, 1.0),
    ];
    corners
        .map(|(x, y, to_x, to_y)| {
            let (x, y) = (x + to_x * width / 2.0, y + to_y * height / 2.0);
            [origin_x + cos * x - sin * y, origin_y + sin * x + cos * y]
        })
        .into()
}
