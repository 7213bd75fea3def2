//! Frames that the rig would record in possible experiments: the parts of `diagnose`, and two experiments of the paper.
//!
//! Places, depths and times are those of the scripts in `experiments/`. Random orders differ from those of the scripts.

use tactus_model::Registration;
use tactus_schema::table::{Phase, RowView};

use crate::data::{Frames, Known, interval_s};
use crate::numbers::Rng;

/// A possible experiment.
#[derive(Debug, Clone)]
pub(super) struct Design {
    /// Name of the experiment, or of the part of `diagnose`.
    pub(super) name: &'static str,
    pub(super) experiment: &'static str,
    pub(super) parameters: Vec<(&'static str, String)>,
    pub(super) duration_s: f64,
    /// Positions of the stage over time; the counts are 0.
    pub(super) frames: Frames,
}

impl Design {
    /// True at its full length.
    pub(super) fn is_whole(&self) -> bool {
        self.parameters.iter().all(|(key, _)| *key != "scale")
    }
}

/// Limits of possible experiments: what the rig has done so far.
#[derive(Debug)]
pub(super) struct DesignSpace<'a> {
    known: &'a Known,
    covering_mm: f64,
    indenter: &'a str,
    interval_s: f64,
    /// Depth of the presses of `diagnose` as a share of the covering; its ladder goes a fifth deeper.
    depth_share: f64,
    /// Greatest depth reached with the present covering.
    deepest_mm: f64,
    load_mm_per_s: f64,
    /// Speed of the fastest load.
    fastest_mm_per_s: f64,
    safe_mm: f64,
}

/// Defaults of `diagnose`.
const SHARE: f64 = 0.5;
pub(super) const SPEEDS_MM_PER_S: [f64; 6] = [0.1, 0.2, 0.3, 0.5, 0.7, 1.0];
const ASIDE_MM: f64 = 1.0;
const DWELL_S: f64 = 0.25;
const ELEMENT_DEPTHS_MM: [f64; 5] = [0.2, 0.3, 0.4, 0.5, 0.6];
/// Values of `diagnose`'s parameter `scale`: a short and a full form of each part.
const SCALES: [f64; 2] = [0.3, 1.0];
/// Tolerance, as a factor, for depths and speeds that count as reached.
const NEARLY: f64 = 1.05;
const APPROACH_MM: f64 = 0.3;
const TRAVEL_MM_PER_S: f64 = 20.0;

type DiagnosePart = fn(&mut DesignBuilder<'_>);

const PARTS: [(&str, DiagnosePart); 11] = [
    ("drift", |builder| builder.drift()),
    ("repeats", |builder| builder.repeats()),
    ("ladder", |builder| builder.ladder()),
    ("rates", |builder| builder.rates()),
    ("approach", |builder| builder.approach()),
    ("reversals", |builder| builder.reversals()),
    ("tilt", |builder| builder.tilt()),
    ("depths", |builder| builder.depths()),
    ("wide", |builder| builder.wide()),
    ("hold", |builder| builder.hold()),
    ("rests", |builder| builder.rests()),
];

/// Parts that do not look for responding elements first.
const WITHOUT_SITES: [&str; 4] = ["drift", "tilt", "depths", "wide"];

impl<'a> DesignSpace<'a> {
    /// Limits from all frames, with the covering and indenter of the last.
    pub(super) fn of(known: &'a Known, frames: &'a Frames) -> Self {
        let covering_mm = frames.covering_mm.last().copied().unwrap_or(1.0);
        let tool = frames.indenter.last().and_then(|tool| frames.indenters.get(usize::from(*tool)));
        let here = (0..frames.len()).filter(|frame| (frames.covering_mm[*frame] - covering_mm).abs() < 1e-6);
        let deepest_mm = here.map(|frame| -frames.position_mm[frame][2]).fold(0.0, f64::max);
        let loads: Vec<f64> = (1..frames.len()).filter_map(|frame| load_mm_per_s(frames, frame)).collect();
        let load_mm_per_s = if loads.is_empty() { 1.0 } else { crate::numbers::median(&loads) };
        let reached = NEARLY * deepest_mm / (1.2 * covering_mm);
        let hundredths = (100.0 * deepest_mm / (1.2 * covering_mm)).floor().max(5.0);
        Self {
            known,
            covering_mm,
            indenter: tool.map_or("", String::as_str),
            interval_s: interval_s(frames),
            depth_share: if reached >= SHARE { SHARE } else { hundredths / 100.0 },
            deepest_mm,
            load_mm_per_s,
            fastest_mm_per_s: NEARLY * loads.iter().copied().fold(load_mm_per_s, f64::max),
            safe_mm: frames.position_mm.iter().map(|at| at[2]).fold(1.0, f64::max).min(5.0),
        }
    }

    /// All possible experiments.
    pub(super) fn designs(&self) -> Vec<Design> {
        let mut designs: Vec<Design> = Vec::new();
        for (name, part) in PARTS {
            for scale in SCALES {
                let mut builder = DesignBuilder::new(self, scale);
                builder.wait(1.0);
                if !WITHOUT_SITES.contains(&name) {
                    builder.find_sites();
                }
                builder.wait(0.5);
                part(&mut builder);
                let mut parameters = vec![("parts", name.to_owned())];
                if scale < 1.0 {
                    parameters.push(("scale", scale.to_string()));
                }
                if self.depth_share < SHARE {
                    parameters.push(("depth_share", self.depth_share.to_string()));
                }
                let speeds = self.speeds_mm_per_s();
                if name == "rates" && speeds.len() < SPEEDS_MM_PER_S.len() {
                    parameters.push(("speeds_mm_per_s", list(&speeds)));
                }
                designs.push(builder.design(name, "diagnose", parameters));
            }
        }
        designs.push(self.element_centres());
        designs.push(self.grid_sweep());
        designs
    }

    fn speeds_mm_per_s(&self) -> Vec<f64> {
        let slowest = SPEEDS_MM_PER_S[0];
        SPEEDS_MM_PER_S.into_iter().filter(|speed| *speed <= self.fastest_mm_per_s.max(slowest)).collect()
    }

    fn element_centres(&self) -> Design {
        let deepest_mm = ELEMENT_DEPTHS_MM[4];
        let by = if NEARLY * self.deepest_mm >= deepest_mm { 1.0 } else { self.deepest_mm / deepest_mm };
        let depths_mm = ELEMENT_DEPTHS_MM.map(|depth_mm| (1000.0 * by * depth_mm).floor() / 1000.0);
        let mut builder = DesignBuilder::new(self, 1.0);
        let mut centres_mm = builder.centres_mm.clone();
        builder.rng.shuffle(&mut centres_mm);
        for centre_mm in centres_mm {
            builder.press(centre_mm, &depths_mm, DWELL_S);
        }
        let parameters = if by < 1.0 { vec![("depths_mm", list(&depths_mm))] } else { Vec::new() };
        builder.design("element-centres", "element-centres", parameters)
    }

    /// Five by five places about the middle, with the present covering.
    fn grid_sweep(&self) -> Design {
        let shares = [0.3, 0.5, 0.65].map(|share: f64| share.min(self.deepest_mm / self.covering_mm));
        let mut builder = DesignBuilder::new(self, 1.0);
        let [x_mm, y_mm] = builder.sites_mm[0];
        let mut presses = Vec::new();
        for row in -2..=2 {
            for col in -2..=2 {
                let at_mm = [x_mm + 0.35 * f64::from(col), y_mm + 0.35 * f64::from(row)];
                presses.extend(shares.map(|share| (at_mm, share * self.covering_mm)));
            }
        }
        builder.rng.shuffle(&mut presses);
        for (at_mm, depth_mm) in presses {
            builder.press(at_mm, &[depth_mm], DWELL_S);
        }
        let mut parameters = vec![
            ("coverings_mm", list(&[self.covering_mm])),
            ("points", "5".into()),
            ("spacing_mm", "0.35".into()),
        ];
        if shares[2] < 0.65 {
            parameters.push(("depth_shares", list(&shares.map(|share| (100.0 * share).floor() / 100.0))));
        }
        builder.design("grid-sweep", "grid-sweep", parameters)
    }
}

fn load_mm_per_s(frames: &Frames, frame: usize) -> Option<f64> {
    let is_load = [frame - 1, frame].iter().all(|one| frames.phase[*one] == Phase::Load);
    let dt_s = frames.t_s[frame] - frames.t_s[frame - 1];
    let fall_mm = frames.position_mm[frame - 1][2] - frames.position_mm[frame][2];
    (is_load && dt_s > 0.0 && fall_mm > 0.001).then(|| fall_mm / dt_s)
}

fn list(values: &[f64]) -> String {
    format!("{values:?}").replace(' ', "")
}

/// Builds the frames of a design by following the path of the stage.
struct DesignBuilder<'a> {
    space: &'a DesignSpace<'a>,
    registration: Registration,
    centres_mm: Vec<[f64; 2]>,
    /// The middle element and two others, as `diagnose` chooses them if none is faulty.
    sites_mm: [[f64; 2]; 3],
    depth_mm: f64,
    scale: f64,
    rng: Rng,
    t_s: f64,
    at_mm: [f64; 3],
    press: i32,
    frames: Frames,
}

impl<'a> DesignBuilder<'a> {
    fn new(space: &'a DesignSpace<'a>, scale: f64) -> Self {
        let array = &space.known.array;
        let centres_mm: Vec<[f64; 2]> =
            (0..array.elements()).filter_map(|element| array.centre_mm(element)).collect();
        let middle_mm = array.extent_mm().map(|[least, most]| f64::midpoint(least, most));
        let mut from_middle = centres_mm.clone();
        let away = |at: &[f64; 2]| (at[0] - middle_mm[0]).abs() + (at[1] - middle_mm[1]).abs();
        from_middle.sort_by(|one, other| away(one).total_cmp(&away(other)));
        let count = from_middle.len();
        let [x, y] = space.known.registration.to_robot(middle_mm);
        Self {
            space,
            registration: space.known.registration,
            sites_mm: [0, count / 3, 2 * count / 3]
                .map(|place| from_middle.get(place).copied().unwrap_or(middle_mm)),
            centres_mm,
            depth_mm: space.depth_share * space.covering_mm,
            scale,
            rng: Rng::new(1),
            t_s: 0.0,
            at_mm: [x, y, space.safe_mm],
            press: 0,
            frames: Frames::new(array.elements()),
        }
    }

    fn design(
        self,
        name: &'static str,
        experiment: &'static str,
        parameters: Vec<(&'static str, String)>,
    ) -> Design {
        Design { name, experiment, parameters, duration_s: self.t_s, frames: self.frames }
    }

    /// Presses on the sites and their neighbours, by which `diagnose` checks that they respond.
    fn find_sites(&mut self) {
        let pitch_mm = self.pitch_mm();
        for [x, y] in self.sites_mm {
            for [dx, dy] in [[0.0, 0.0], [-1.0, 0.0], [1.0, 0.0], [0.0, -1.0], [0.0, 1.0]] {
                self.press([x + pitch_mm * dx, y + pitch_mm * dy], &[self.depth_mm], DWELL_S);
            }
        }
    }

    fn drift(&mut self) {
        for _ in 0..self.times(36) {
            self.wait(5.0);
        }
    }

    fn repeats(&mut self) {
        for _ in 0..self.times(30) {
            self.press(self.sites_mm[0], &[self.depth_mm], DWELL_S);
        }
    }

    fn ladder(&mut self) {
        let up = [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.0, 0.8, 0.6, 0.4, 0.2];
        for site_mm in self.sites_mm {
            self.wait(0.5);
            self.press(site_mm, &up.map(|by| by * self.depth_mm), DWELL_S);
        }
    }

    fn rates(&mut self) {
        let mut speeds = self.space.speeds_mm_per_s().repeat(self.times(3));
        self.rng.shuffle(&mut speeds);
        for load_mm_per_s in speeds {
            self.press_from(self.sites_mm[0], &[self.depth_mm], DWELL_S, load_mm_per_s, [0.0; 2]);
        }
    }

    fn approach(&mut self) {
        for way_mm in self.ways(5) {
            self.press_from(self.sites_mm[0], &[self.depth_mm], DWELL_S, self.space.load_mm_per_s, way_mm);
        }
    }

    fn reversals(&mut self) {
        let mut loops_mm = Vec::new();
        for middle in [0.3, 0.6, 0.9] {
            for width in [0.02, 0.1, 0.3] {
                loops_mm.extend([middle + width / 2.0, middle - width / 2.0].map(|by| by * self.depth_mm));
            }
        }
        loops_mm.push(0.5 * self.depth_mm);
        for [x, y] in self.sites_mm {
            self.wait(0.5);
            for _ in 0..self.times(3) {
                self.press([x, y], &loops_mm, DWELL_S);
            }
            let depths_mm = [self.depth_mm / 4.0, self.depth_mm];
            for way_mm in self.ways(3) {
                self.press_from([x + 0.5, y + 0.5], &depths_mm, DWELL_S, self.space.load_mm_per_s, way_mm);
            }
        }
    }

    fn tilt(&mut self) {
        self.elements(|row, col| (row + col) % 2 == 0, 0.0, &[0.5, 1.0], DWELL_S);
    }

    fn depths(&mut self) {
        self.elements(|row, col| (row + col) % 3 == 0, 0.4, &[0.1, 0.2, 0.5, 1.0], 2.0 * DWELL_S);
    }

    fn wide(&mut self) {
        let [rows, cols] = [self.space.known.array.rows(), self.space.known.array.cols()];
        let mut places_mm = Vec::new();
        for row in [0, (rows - 1) / 2, rows - 1] {
            for col in [0, (cols - 1) / 2, cols - 1] {
                let centre_mm = self.centres_mm[row * cols + col];
                for pitches in [0.0, 0.25, 0.5] {
                    let beside_mm = self.inwards(centre_mm, pitches);
                    places_mm.extend([beside_mm, [centre_mm[0], beside_mm[1]]]);
                }
            }
        }
        self.rng.shuffle(&mut places_mm);
        places_mm.truncate(self.times(places_mm.len()));
        for place_mm in places_mm {
            self.press(place_mm, &[self.depth_mm], 2.0);
        }
    }

    fn hold(&mut self) {
        for site_mm in self.sites_mm {
            self.wait(0.5);
            self.press(site_mm, &[self.depth_mm], self.times(50) as f64);
            self.wait(2.0 * self.times(30) as f64);
        }
    }

    fn rests(&mut self) {
        for (site, site_mm) in self.sites_mm.into_iter().enumerate() {
            self.wait(0.5);
            self.press(site_mm, &[self.depth_mm], self.times(30) as f64);
            self.wait(self.times(40) as f64);
            for light_mm in [site_mm, self.sites_mm[(site + 2) % 3]] {
                self.press(light_mm, &[self.depth_mm / 4.0], DWELL_S);
            }
        }
    }

    /// Presses beside selected elements, in random order, to shares of the depth.
    fn elements(&mut self, is_one: fn(usize, usize) -> bool, pitches: f64, shares: &[f64], dwell_s: f64) {
        let cols = self.space.known.array.cols();
        let some = self.centres_mm.iter().enumerate().filter(|(index, _)| is_one(index / cols, index % cols));
        let mut chosen_mm: Vec<[f64; 2]> = some.map(|(_, centre_mm)| *centre_mm).collect();
        self.rng.shuffle(&mut chosen_mm);
        chosen_mm.truncate(self.times(chosen_mm.len()));
        let depths_mm: Vec<f64> = shares.iter().map(|share| share * self.depth_mm).collect();
        for centre_mm in chosen_mm {
            self.press(self.inwards(centre_mm, pitches), &depths_mm, dwell_s);
        }
    }

    fn inwards(&self, [x, y]: [f64; 2], pitches: f64) -> [f64; 2] {
        let middle_mm = self.space.known.array.extent_mm().map(|[least, most]| f64::midpoint(least, most));
        let by_mm = pitches * self.pitch_mm();
        [x + if x < middle_mm[0] { by_mm } else { -by_mm }, y + if y < middle_mm[1] { by_mm } else { -by_mm }]
    }

    fn pitch_mm(&self) -> f64 {
        self.space.known.array.pitch_mm()
    }

    fn ways(&mut self, full: usize) -> Vec<[f64; 2]> {
        let four_mm = [[-ASIDE_MM, 0.0], [ASIDE_MM, 0.0], [0.0, -ASIDE_MM], [0.0, ASIDE_MM]];
        let mut ways_mm = four_mm.repeat(self.times(full));
        self.rng.shuffle(&mut ways_mm);
        ways_mm
    }

    /// A number of repetitions, scaled; at least two.
    fn times(&self, full: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some dozens")]
        let scaled = (full as f64 * self.scale) as usize;
        scaled.max(2)
    }

    fn press(&mut self, at_mm: [f64; 2], depths_mm: &[f64], dwell_s: f64) {
        self.press_from(at_mm, depths_mm, dwell_s, self.space.load_mm_per_s, [0.0; 2]);
    }

    fn press_from(
        &mut self,
        at_mm: [f64; 2],
        depths_mm: &[f64],
        dwell_s: f64,
        load_mm_per_s: f64,
        from_mm: [f64; 2],
    ) {
        let [x, y] = self.registration.to_robot(at_mm);
        let [aside_x, aside_y] = self.registration.to_robot([at_mm[0] + from_mm[0], at_mm[1] + from_mm[1]]);
        let (safe_mm, index) = (self.space.safe_mm, self.press);
        self.press += 1;
        self.go([aside_x, aside_y, safe_mm], TRAVEL_MM_PER_S, -1, Phase::Idle);
        self.go([aside_x, aside_y, APPROACH_MM], TRAVEL_MM_PER_S, index, Phase::Approach);
        self.go([x, y, APPROACH_MM], TRAVEL_MM_PER_S, index, Phase::Approach);
        let mut last_mm = 0.0;
        for depth_mm in depths_mm {
            let phase = if *depth_mm >= last_mm { Phase::Load } else { Phase::Unload };
            self.go([x, y, -depth_mm], load_mm_per_s, index, phase);
            self.until(dwell_s, self.at_mm, index, Phase::Hold);
            last_mm = *depth_mm;
        }
        self.go([x, y, 0.0], load_mm_per_s, index, Phase::Unload);
        self.go([x, y, safe_mm], TRAVEL_MM_PER_S, index, Phase::Retract);
    }

    fn wait(&mut self, duration_s: f64) {
        self.until(duration_s, self.at_mm, -1, Phase::Idle);
    }

    fn go(&mut self, to_mm: [f64; 3], speed_mm_per_s: f64, press: i32, phase: Phase) {
        let way_mm = to_mm.iter().zip(self.at_mm).map(|(to, at)| (to - at).powi(2)).sum::<f64>().sqrt();
        self.until(way_mm / speed_mm_per_s, to_mm, press, phase);
    }

    /// Moves to a position in a given time, and adds the frames on the way.
    fn until(&mut self, duration_s: f64, to_mm: [f64; 3], press: i32, phase: Phase) {
        let (begin_s, from_mm) = (self.t_s, self.at_mm);
        self.t_s += duration_s;
        self.at_mm = to_mm;
        let counts = vec![0.0; self.frames.elements];
        loop {
            let t_s = self.frames.len() as f64 * self.space.interval_s;
            if t_s >= self.t_s {
                return;
            }
            let share = ((t_s - begin_s) / duration_s).clamp(0.0, 1.0);
            #[expect(clippy::cast_possible_truncation, reason = "some minutes")]
            let t_ns = (t_s * 1e9).round() as i64;
            self.frames.push(RowView {
                run: "next",
                press,
                phase,
                t_ns,
                position_mm: [0, 1, 2].map(|axis| from_mm[axis] + share * (to_mm[axis] - from_mm[axis])),
                covering_mm: self.space.covering_mm,
                indenter: self.space.indenter,
                temperature_c: None,
                counts: &counts,
            });
        }
    }
}
