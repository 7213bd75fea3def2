use std::{io::Write, panic};

use tempfile::NamedTempFile;

use super::*;

fn file(bytes: usize) -> NamedTempFile {
    let mut file = NamedTempFile::new().unwrap();
    file.write_all(&vec![0; bytes]).unwrap();
    file
}

fn read(file: &NamedTempFile) {
    io::copy(&mut MeteredFile(File::open(file.path()).unwrap()), &mut io::sink()).unwrap();
}

#[test]
fn the_share_is_of_all_files_and_passes_by_their_cost() {
    let (long, short) = (file(300), file(100));
    let told = Rc::new(Cell::new(None));
    let tell = {
        let told = Rc::clone(&told);
        move |share| told.set(Some(share))
    };
    let is_told = |due: f64| told.get().is_some_and(|share: f64| (share - due).abs() < 1e-9);
    metered(tell, || {
        // Nothing is told of files that nobody announced.
        read(&long);
        assert_eq!(told.get(), None);
        let whole = 300.0 + 3.0 * 300.0 + 100.0;
        will_read(long.path(), &[1.0, 3.0]);
        will_read(short.path(), &[1.0]);
        will_read("not there", &[1.0]);
        read(&long);
        assert!(is_told(300.0 / whole), "{told:?}");
        read(&long);
        assert!(is_told(1200.0 / whole), "{told:?}");
        read(&short);
        assert!(is_told(1.0), "{told:?}");
    });
    told.set(None);
    // After the job nothing counts.
    read(&short);
    assert_eq!(told.get(), None);
}

#[test]
fn a_job_that_panics_leaves_no_meter_behind() {
    let file = file(10);
    let job = || {
        metered(
            |_| (),
            || {
                will_read(file.path(), &[1.0]);
                panic!("the job");
            },
        );
    };
    panic::catch_unwind(panic::AssertUnwindSafe(job)).unwrap_err();
    METER.with_borrow(|meter| assert!(meter.is_none()));
}
