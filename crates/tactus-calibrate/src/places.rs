//! Places of presses in the plane of the array, and which of them are the same.
//!
//! Each place is compared with those in the cells around it alone: of presses all over an array these are few, however many there are.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_1_SQRT_2;

/// Places that are no further from each other, in mm, count as the same.
pub const SAME_PLACE_MM: f64 = 0.05;

/// True if two places, in mm, are not the same.
pub fn far([x, y]: [f64; 2], [other_x, other_y]: [f64; 2]) -> bool {
    (x - other_x).hypot(y - other_y) > SAME_PLACE_MM
}

/// A square of the plane, in which all places are the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Cell([i64; 2]);

impl Cell {
    /// That of a place in mm.
    pub fn of(place_mm: [f64; 2]) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "a length over a small one")]
        let number = |at_mm: f64| (at_mm / (FRAC_1_SQRT_2 * SAME_PLACE_MM)).floor() as i64;
        Self(place_mm.map(number))
    }

    /// The cells in which places may be that are not far from those of this one, itself included.
    pub fn around(self) -> impl Iterator<Item = Self> {
        let Self([x, y]) = self;
        (-2..=2).flat_map(move |right| {
            (-2..=2).map(move |up| Self([x.saturating_add(right), y.saturating_add(up)]))
        })
    }
}

/// Places in mm of which each is far from all that come before it, in order.
pub fn distinct_places(places_mm: impl IntoIterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut cells: BTreeMap<Cell, Vec<[f64; 2]>> = BTreeMap::new();
    let mut places = Vec::new();
    for place in places_mm {
        let cell = Cell::of(place);
        if cell.around().filter_map(|near| cells.get(&near)).flatten().all(|other| far(place, *other)) {
            cells.entry(cell).or_default().push(place);
            places.push(place);
        }
    }
    places
}

#[cfg(test)]
#[path = "places_tests.rs"]
mod tests;
