//! One worker's way through the pieces.

use std::{
    collections::VecDeque,
    num::NonZeroUsize,
    sync::{Mutex, MutexGuard, PoisonError, mpsc::channel},
    thread,
    time::{Duration, Instant},
};

use crate::{
    Stop,
    bar::Now,
    claim::{Asked, Claim, ClaimError, Claims, Seen},
    threads::for_each,
};

/// Work of many pieces, whose results are files that other workers see.
pub trait Work: Sync {
    /// A piece.
    type Piece: Sync;
    /// The result of a piece, before others see it.
    type Made;
    /// Why a piece cannot be done: then nothing more is begun.
    type Error: From<ClaimError> + Send;

    /// Name of a piece, unlike that of any other: a relative path.
    fn name(&self, piece: &Self::Piece) -> String;

    /// Size of a piece, for the progress.
    fn size(&self, _piece: &Self::Piece) -> u64 {
        1
    }

    /// True if the result of a piece is there.
    ///
    /// # Errors
    /// If it cannot be told, or if the result is none for this work.
    fn is_done(&self, piece: &Self::Piece) -> Result<bool, Self::Error>;

    /// Does a piece; `None` if `stop` was set before the end.
    ///
    /// # Errors
    /// If it cannot be done.
    fn make(&self, piece: &Self::Piece, stop: &Stop) -> Result<Option<Self::Made>, Self::Error>;

    /// Shows the result to all. What [`Self::is_done`] looks at must appear last, and whole.
    ///
    /// # Errors
    /// If it cannot be written.
    fn keep(&self, piece: &Self::Piece, made: Self::Made) -> Result<(), Self::Error>;
}

/// Who works, and how.
#[derive(Debug)]
pub struct Worker {
    /// Its claims.
    pub claims: Claims,
    /// Pieces that it does at a time.
    pub threads: NonZeroUsize,
    /// When it is to end.
    pub stop: Stop,
}

/// What a worker did.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Worked {
    /// Pieces that it did.
    pub done: usize,
    /// Pieces that were done before.
    pub kept: usize,
    /// Pieces that other workers did meanwhile.
    pub by_others: usize,
    /// Names of pieces that it did, but that others had taken over, because it had been silent for longer than its lease. Its results of
    /// these were dropped.
    pub lost: Vec<String>,
    /// Pieces that are left: `stop` was set.
    pub left: usize,
}

/// Does all pieces whose results are not there, with the other workers that have claims in the same folder. Returns when all pieces are done,
/// by whomever, or the worker is to end. `progress` gets the name of the piece that was done last; at the beginning there is none.
///
/// # Errors
/// The first one of any piece. Pieces that were in work are ended before.
pub fn work<W: Work>(
    work: &W,
    pieces: &[W::Piece],
    worker: &Worker,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked, W::Error> {
    let Worker { claims, threads, stop } = worker;
    let under_way = UnderWay { work, claims, stop, progress, state: Mutex::default() };
    under_way.look(*threads, pieces)?;
    // Few threads suffice for few pieces.
    let open = under_way.state().open.len().min(threads.get());
    thread::scope(|scope| {
        let (_works, over) = channel();
        scope.spawn(move || claims.renew_until(&over));
        for_each(*threads, &vec![(); open], |()| under_way.run(pieces));
    });
    under_way.end()
}

struct UnderWay<'a, W: Work> {
    work: &'a W,
    claims: &'a Claims,
    stop: &'a Stop,
    progress: &'a (dyn Fn(Option<&str>, Now) + Sync),
    state: Mutex<State<W::Error>>,
}

struct State<E> {
    /// Pieces that nobody was seen to have.
    open: VecDeque<usize>,
    /// Pieces that other workers have, with the one to look at first in front.
    taken: VecDeque<Taken>,
    now: Now,
    worked: Worked,
    error: Option<E>,
}

struct Taken {
    piece: usize,
    /// Its claim, if it was seen.
    seen: Option<Seen>,
    look_at: Instant,
}

/// What a thread does next.
enum Next {
    Ask(usize, Option<Seen>),
    Wait(Duration),
    End,
}

/// What came of a piece.
enum Came {
    Done,
    DoneByOther,
    Taken(Seen),
    Lost,
    Stopped,
}

/// So long a thread that waits does not look whether it is to stop.
const LOOK_AGAIN: Duration = Duration::from_millis(50);

impl<E> Default for State<E> {
    fn default() -> Self {
        Self {
            open: VecDeque::new(),
            taken: VecDeque::new(),
            now: Now::default(),
            worked: Worked::default(),
            error: None,
        }
    }
}

impl<W: Work> UnderWay<'_, W> {
    /// Finds out which pieces are open.
    fn look(&self, threads: NonZeroUsize, pieces: &[W::Piece]) -> Result<(), W::Error> {
        let numbers: Vec<usize> = (0..pieces.len()).collect();
        for_each(threads, &numbers, |number| {
            let Some(piece) = pieces.get(*number) else { return };
            let (done, size) = (self.work.is_done(piece), self.work.size(piece));
            let mut state = self.state();
            state.now.pieces_all += 1;
            state.now.size_all += size;
            match done {
                Ok(true) => {
                    state.worked.kept += 1;
                    state.now.pieces += 1;
                    state.now.size += size;
                }
                Ok(false) => state.open.push_back(*number),
                Err(error) => state.error = Some(error),
            }
        });
        let mut state = self.state();
        state.open.make_contiguous().sort_unstable();
        (self.progress)(None, state.now);
        state.error.take().map_or(Ok(()), Err)
    }

    /// Does pieces until none is left to this thread.
    fn run(&self, pieces: &[W::Piece]) {
        loop {
            match self.next() {
                Next::Ask(number, seen) => {
                    let Some(piece) = pieces.get(number) else { return };
                    let came = self.ask(piece, seen);
                    self.take(number, piece, came);
                }
                Next::Wait(time) => thread::sleep(time.min(LOOK_AGAIN)),
                Next::End => return,
            }
        }
    }

    /// Pieces of others are looked at in time, so that the progress is true and those of dead workers are taken over.
    fn next(&self) -> Next {
        let mut state = self.state();
        if self.stop.is_set() || state.error.is_some() {
            return Next::End;
        }
        let wait = state.taken.front().map(|taken| taken.look_at.saturating_duration_since(Instant::now()));
        match wait {
            Some(Duration::ZERO) => {
                state.taken.pop_front().map_or(Next::End, |taken| Next::Ask(taken.piece, taken.seen))
            }
            _ => match (state.open.pop_front(), wait) {
                (Some(piece), _) => Next::Ask(piece, None),
                (None, Some(wait)) => Next::Wait(wait),
                (None, None) => Next::End,
            },
        }
    }

    fn ask(&self, piece: &W::Piece, seen: Option<Seen>) -> Result<Came, W::Error> {
        if self.work.is_done(piece)? {
            return Ok(Came::DoneByOther);
        }
        match self.claims.ask(&self.work.name(piece), seen)? {
            Asked::Taken(seen) => Ok(Came::Taken(seen)),
            Asked::Mine(claim) => self.make(piece, claim),
        }
    }

    fn make(&self, piece: &W::Piece, claim: Claim<'_>) -> Result<Came, W::Error> {
        // It may have been done just before the claim.
        if self.work.is_done(piece)? {
            claim.done()?;
            return Ok(Came::DoneByOther);
        }
        let made = self.work.make(piece, self.stop);
        // Whoever has the piece now tells its errors, too.
        if claim.is_lost()? {
            return Ok(Came::Lost);
        }
        let Some(made) = made? else { return Ok(Came::Stopped) };
        self.work.keep(piece, made)?;
        claim.done()?;
        Ok(Came::Done)
    }

    fn take(&self, number: usize, piece: &W::Piece, came: Result<Came, W::Error>) {
        let mut state = self.state();
        match came {
            Ok(Came::Done) => state.worked.done += 1,
            Ok(Came::DoneByOther) => state.worked.by_others += 1,
            Ok(Came::Taken(seen)) => return state.look_later(number, Some(seen), self.claims.look_again()),
            Ok(Came::Lost) => {
                state.worked.lost.push(self.work.name(piece));
                return state.look_later(number, None, self.claims.look_again());
            }
            Ok(Came::Stopped) => return,
            Err(error) => {
                state.error.get_or_insert(error);
                return;
            }
        }
        state.now.pieces += 1;
        state.now.size += self.work.size(piece);
        (self.progress)(Some(&self.work.name(piece)), state.now);
    }

    fn end(self) -> Result<Worked, W::Error> {
        let State { now, mut worked, error, .. } =
            self.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        worked.left = now.pieces_all - now.pieces;
        error.map_or(Ok(worked), Err)
    }

    fn state(&self) -> MutexGuard<'_, State<W::Error>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<E> State<E> {
    fn look_later(&mut self, piece: usize, seen: Option<Seen>, after: Duration) {
        self.taken.push_back(Taken { piece, seen, look_at: Instant::now() + after });
    }
}

#[cfg(test)]
#[path = "worker_tests.rs"]
mod tests;
