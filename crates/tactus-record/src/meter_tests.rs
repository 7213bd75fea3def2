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
fn the_share_is_of_all_files_and_passes() {
    let files = [file(300), file(100)];
    let told = Rc::new(RefCell::new(Vec::new()));
    let tell = {
        let told = Rc::clone(&told);
        move |share| told.borrow_mut().push(share)
    };
    metered(tell, || {
        // Nothing is told of files that nobody announced.
        read(&files[0]);
        assert!(told.borrow().is_empty());
        will_read(&[files[0].path(), files[1].path(), Path::new("not there")], 2);
        read(&files[1]);
    });
    // After the job nothing counts.
    read(&files[0]);
    let told = told.borrow();
    assert!(told.iter().all(|share| (share - 400.0 / 800.0).abs() < 1e-9), "{told:?}");
    assert!(!told.is_empty());
}

#[test]
fn a_job_that_panics_leaves_no_meter_behind() {
    let file = file(10);
    let job = || {
        metered(
            |_| panic!("told"),
            || {
                will_read(&[file.path()], 1);
                panic!("the job");
            },
        )
    };
    panic::catch_unwind(panic::AssertUnwindSafe(job)).unwrap_err();
    read(&file);
}
