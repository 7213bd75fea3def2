use std::{
    fs,
    num::NonZeroUsize,
    path::{Path, PathBuf},
    sync::Mutex,
    thread,
    time::Duration,
};

use tempfile::TempDir;

use super::{Work, Worked, Worker, work};
use crate::{ClaimError, Claims, Now, Stop, write_whole};

/// Writes the square of each number into a file. Numbers are done in `made` as often as they stand there.
struct Squares<'a> {
    folder: &'a Path,
    made: &'a Mutex<Vec<u32>>,
    /// What happens in the middle of a piece.
    meanwhile: &'a (dyn Fn(u32, &Stop) -> Result<(), Failed> + Sync),
}

#[derive(Debug, PartialEq)]
struct Failed(String);

impl From<ClaimError> for Failed {
    fn from(error: ClaimError) -> Self {
        Self(error.to_string())
    }
}

impl Squares<'_> {
    fn path(&self, number: u32) -> PathBuf {
        self.folder.join("results").join(self.name(&number))
    }
}

impl Work for Squares<'_> {
    type Piece = u32;
    type Made = u32;
    type Error = Failed;

    fn name(&self, piece: &u32) -> String {
        format!("squares/{piece}")
    }

    fn is_done(&self, piece: &u32) -> Result<bool, Failed> {
        Ok(self.path(*piece).exists())
    }

    fn make(&self, piece: &u32, stop: &Stop) -> Result<Option<u32>, Failed> {
        (self.meanwhile)(*piece, stop)?;
        self.made.lock().unwrap().push(*piece);
        Ok((!stop.is_set()).then_some(piece * piece))
    }

    fn keep(&self, piece: &u32, made: u32) -> Result<(), Failed> {
        write_whole(&self.path(*piece), made.to_string().as_bytes()).unwrap();
        Ok(())
    }
}

/// A worker for the first 20 numbers.
fn worker(
    squares: &Squares<'_>,
    threads: usize,
    progress: &(dyn Fn(Option<&str>, Now) + Sync),
) -> Result<Worked, Failed> {
    let worker = Worker {
        claims: Claims::new(claims(squares.folder), Duration::from_hours(1)),
        threads: NonZeroUsize::new(threads).unwrap(),
        stop: Stop::default(),
    };
    work(squares, &(0..20).collect::<Vec<_>>(), &worker, progress)
}

fn claims(folder: &Path) -> PathBuf {
    folder.join("claims")
}

fn claims_left(folder: &Path) -> usize {
    fs::read_dir(claims(folder).join("squares")).unwrap().count()
}

#[test]
fn two_workers_share_the_pieces_and_do_each_once() {
    let folder = TempDir::new().unwrap();
    let made = Mutex::default();
    let squares = Squares { folder: folder.path(), made: &made, meanwhile: &|_, _| Ok(()) };
    let last = Mutex::new(Now::default());
    let alone = |now: Now| *last.lock().unwrap() = now;
    let [one, other] = thread::scope(|scope| {
        let other = scope.spawn(|| worker(&squares, 2, &|_, _| ()).unwrap());
        [worker(&squares, 2, &|_, now| alone(now)).unwrap(), other.join().unwrap()]
    });
    let mut made = made.into_inner().unwrap();
    made.sort_unstable();
    assert_eq!(made, (0..20).collect::<Vec<_>>());
    assert_eq!(one.done + other.done, 20);
    for worked in [&one, &other] {
        assert_eq!((worked.done + worked.by_others + worked.kept, worked.left), (20, 0), "{worked:?}");
    }
    assert_eq!(last.into_inner().unwrap(), Now { pieces: 20, pieces_all: 20, size: 20, size_all: 20 });
    assert_eq!(claims_left(folder.path()), 0);
    assert_eq!(fs::read_to_string(folder.path().join("results/squares/7")).unwrap(), "49");
}

#[test]
fn work_that_was_stopped_goes_on_where_it_ended() {
    let folder = TempDir::new().unwrap();
    let made = Mutex::default();
    let stopping = |number, stop: &Stop| {
        if number == 7 {
            stop.set();
        }
        Ok(())
    };
    let squares = Squares { folder: folder.path(), made: &made, meanwhile: &stopping };
    let first = worker(&squares, 2, &|_, _| ()).unwrap();
    assert!(first.left > 0 && first.done + first.left == 20, "{first:?}");
    assert_eq!(claims_left(folder.path()), 0);
    let squares = Squares { meanwhile: &|_, _| Ok(()), ..squares };
    let begun = Mutex::new(None);
    let first_news = |now: Now| _ = begun.lock().unwrap().get_or_insert(now.pieces);
    let second = worker(&squares, 2, &|_, now| first_news(now)).unwrap();
    assert_eq!(second, Worked { kept: first.done, done: first.left, ..Worked::default() });
    assert_eq!(begun.into_inner().unwrap(), Some(first.done));
}

#[test]
fn nothing_is_begun_after_an_error() {
    let folder = TempDir::new().unwrap();
    let made = Mutex::default();
    let failing = |number, _: &Stop| if number == 3 { Err(Failed("no 3".into())) } else { Ok(()) };
    let squares = Squares { folder: folder.path(), made: &made, meanwhile: &failing };
    assert_eq!(worker(&squares, 1, &|_, _| ()), Err(Failed("no 3".into())));
    assert_eq!(made.into_inner().unwrap(), [0, 1, 2]);
    assert_eq!(claims_left(folder.path()), 0);
}

#[test]
fn the_result_of_a_piece_that_another_took_over_is_dropped() {
    let folder = TempDir::new().unwrap();
    let made = Mutex::default();
    let path = folder.path();
    let taking_over = |number, _: &Stop| {
        if number == 3 {
            fs::write(claims(path).join("squares/3.1"), "").unwrap();
            write_whole(&path.join("results/squares/3"), b"of another").unwrap();
        }
        Ok(())
    };
    let squares = Squares { folder: path, made: &made, meanwhile: &taking_over };
    let worked = worker(&squares, 2, &|_, _| ()).unwrap();
    assert_eq!((worked.done, worked.by_others, &worked.lost[..]), (19, 1, &["squares/3".to_owned()][..]));
    assert_eq!(fs::read_to_string(path.join("results/squares/3")).unwrap(), "of another");
}
