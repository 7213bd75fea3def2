//! What a script sees of the rig.

use serde::{Deserialize, Serialize};
use tactus_schema::Rig;

/// The rig as a script sees it, under the name `rig`. Positions are in the sensor frame.
///
/// It is the rig when the run starts: `covering(...)` does not change it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RigView {
    /// Name of the rig.
    pub name: String,
    /// True if no physical device stands behind it.
    pub simulated: bool,
    /// Rows of elements, along y.
    pub rows: usize,
    /// Columns of elements, along x.
    pub cols: usize,
    /// The elements, row-major.
    pub elements: Vec<ElementView>,
    /// Size of an element along x and y.
    pub element_mm: [f64; 2],
    /// Smallest distance between the centres of neighbours along x and y; the element's size where there are none.
    pub pitch_mm: [f64; 2],
    /// Least and greatest x, least and greatest y of the active area.
    pub extent_mm: [[f64; 2]; 2],
    /// Frames per second.
    pub rate_hz: f64,
    /// Largest reading of an element.
    pub full_scale_counts: f64,
    /// Thickness of the covering in place.
    pub covering_mm: f64,
    /// Greatest depth that the envelope allows under the covering in place; none without an envelope.
    pub depth_max_mm: Option<f64>,
    /// Greatest depth as a share of the covering's thickness; none without an envelope.
    pub depth_share_max: Option<f64>,
    /// Standard deviation of the spread under the covering in place, as the rig file states it.
    pub sigma_mm: f64,
    /// Id of the tool on the stage.
    pub indenter: String,
    /// Where the sensor frame's origin lies in the robot frame, as the rig file states it.
    pub origin_mm: [f64; 2],
    /// Angle from the robot's x axis to the sensor's, as the rig file states it.
    pub rotation_deg: f64,
    /// Height at which the tip travels.
    pub safe_height_mm: Option<f64>,
    /// Default speed of loading.
    pub load_speed_mm_per_s: Option<f64>,
    /// Greatest speed of loading.
    pub load_speed_max_mm_per_s: Option<f64>,
}

/// One element as a script sees it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ElementView {
    /// Index in a reading.
    pub index: usize,
    /// Row, from 0.
    pub row: usize,
    /// Column, from 0.
    pub col: usize,
    /// Its centre along x.
    pub x_mm: f64,
    /// Its centre along y.
    pub y_mm: f64,
}

impl RigView {
    /// The view of a rig.
    pub fn of(rig: &Rig) -> Self {
        let array = &rig.array;
        let cols = array.cols();
        let element = |(index, [x_mm, y_mm]): (usize, [f64; 2])| ElementView {
            index,
            row: index / cols,
            col: index % cols,
            x_mm,
            y_mm,
        };
        let centres = (0..array.elements()).map_while(|index| array.centre_mm(index));
        let service = rig.service.as_ref();
        Self {
            name: rig.name.clone(),
            simulated: rig.simulated,
            rows: array.rows(),
            cols,
            elements: centres.enumerate().map(element).collect(),
            element_mm: array.element_mm(),
            pitch_mm: [
                least_distance(array.col_centres_mm()).unwrap_or(array.element_mm()[0]),
                least_distance(array.row_centres_mm()).unwrap_or(array.element_mm()[1]),
            ],
            extent_mm: array.extent_mm(),
            rate_hz: array.rate_hz(),
            full_scale_counts: array.full_scale_counts(),
            covering_mm: rig.covering.thickness_mm,
            depth_max_mm: rig.depth_max_mm(),
            depth_share_max: service.map(|service| service.envelope.depth_share_max),
            sigma_mm: rig.psf.sigma_mm(rig.covering),
            indenter: rig.indenter.clone(),
            origin_mm: rig.registration.origin_mm,
            rotation_deg: rig.registration.rotation_deg,
            safe_height_mm: service.map(|service| service.motion.safe_height_mm),
            load_speed_mm_per_s: service.map(|service| service.motion.load_speed_mm_per_s),
            load_speed_max_mm_per_s: service.map(|service| service.envelope.load_speed_max_mm_per_s),
        }
    }
}

fn least_distance(centres_mm: &[f64]) -> Option<f64> {
    centres_mm.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?)).reduce(f64::min)
}

#[cfg(test)]
#[path = "rig_view_tests.rs"]
mod tests;
