//! Reduces a list that fails to a small one that still fails.

/// The smallest failing list found, and what it took.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Shrunk<T> {
    /// A part of the given list, in its order; some events may be simpler.
    pub events: Vec<T>,
    /// How often `fails` was asked.
    pub tries: u32,
    /// True if the tries ran out before nothing more could be removed.
    pub is_cut_short: bool,
}

/// Removes events, in halves, quarters and so on down to single ones, and replaces what remains by what `simpler` proposes, as
/// long as `fails` says that the rest still fails. It asks at most `tries_max` times. The given list is taken to fail.
///
/// `fails` must give the same answer for the same list; then so does this function.
///
/// ```
/// use tactus_virtual::schedule::shrink;
///
/// let fails = |events: &[i32]| events.contains(&3) && events.contains(&70);
/// let shrunk = shrink(&[1, 2, 3, 50, 70, 80], |_| Vec::new(), fails, 100);
/// assert_eq!(shrunk.events, [3, 70]);
/// ```
///
/// # Source
/// Delta debugging (Zeller and Hildebrandt, 2002), without the tests of parts alone.
pub fn shrink<T: Clone>(
    events: &[T],
    simpler: impl Fn(&T) -> Vec<T>,
    fails: impl FnMut(&[T]) -> bool,
    tries_max: u32,
) -> Shrunk<T> {
    let mut search = Search { events: events.to_vec(), fails, tries: 0, tries_max };
    while search.remove() | search.simplify(&simpler) {}
    let is_cut_short = search.is_over();
    Shrunk { events: search.events, tries: search.tries, is_cut_short }
}

struct Search<T, F> {
    events: Vec<T>,
    fails: F,
    tries: u32,
    tries_max: u32,
}

impl<T: Clone, F: FnMut(&[T]) -> bool> Search<T, F> {
    /// Removes what can be removed; true if it was anything.
    fn remove(&mut self) -> bool {
        let before = self.events.len();
        let mut size = before.div_ceil(2);
        while size > 0 && !self.is_over() {
            let mut first = 0;
            while first < self.events.len() && !self.is_over() {
                let mut rest = self.events.clone();
                rest.drain(first..(first + size).min(rest.len()));
                // After a removal the next events stand here.
                if !self.keep(rest) {
                    first += size;
                }
            }
            size /= 2;
        }
        self.events.len() < before
    }

    /// Simplifies what can be simplified; true if it was anything.
    fn simplify(&mut self, simpler: &impl Fn(&T) -> Vec<T>) -> bool {
        let mut is_simpler = false;
        for at in 0..self.events.len() {
            let proposals = self.events.get(at).map_or_else(Vec::new, simpler);
            for proposal in proposals {
                let mut events = self.events.clone();
                if let Some(event) = events.get_mut(at) {
                    *event = proposal;
                }
                if !self.is_over() && self.keep(events) {
                    is_simpler = true;
                    break;
                }
            }
        }
        is_simpler
    }

    /// Takes these events if they fail.
    fn keep(&mut self, events: Vec<T>) -> bool {
        self.tries += 1;
        let fails = (self.fails)(&events);
        if fails {
            self.events = events;
        }
        fails
    }

    fn is_over(&self) -> bool {
        self.tries >= self.tries_max
    }
}

#[cfg(test)]
#[path = "shrink_tests.rs"]
mod tests;
