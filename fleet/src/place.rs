//! Where a fleet is: a folder or an address, and its object store.

use std::{fs, io, path::PathBuf, sync::Arc};

use futures::{StreamExt as _, TryStreamExt as _};
use object_store::{ObjectMeta, ObjectStore, path::Path};
use url::Url;

/// A folder of an object store.
#[derive(Debug, Clone)]
pub struct Place {
    url: Url,
    store: Arc<dyn ObjectStore>,
    folder: Path,
}

/// Why a place cannot be used.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message says what each field is")]
pub enum PlaceError {
    /// The folder is missing or cannot be made.
    #[error("{}: {source}", path.display())]
    Folder { path: PathBuf, source: io::Error },
    /// There is no such fleet.
    #[error("{} is not a folder: `tactus fleet ingest RUNS --to {}` makes a fleet there", path.display(), path.display())]
    NoFolder { path: PathBuf },
    /// The address is none, or of a store that this build has not.
    #[error("{url} cannot be used as a fleet: {problem}. It is a folder, file:///FOLDER{s3}", s3 = if cfg!(feature = "s3") { " or s3://BUCKET/FOLDER" } else { ", or s3://BUCKET/FOLDER in a build with `--features s3`" })]
    Address { url: String, problem: String },
    /// There is no run in it.
    #[error("{url} holds no run: `tactus fleet ingest RUNS --to {url}` writes some")]
    Empty { url: String },
    /// The store refused.
    #[error("{url}: {source}")]
    Store { url: String, source: Box<object_store::Error> },
}

impl Place {
    /// A fleet to write to; a folder is made.
    ///
    /// # Errors
    /// If the address is wrong, or the folder cannot be made.
    pub fn create(text: &str) -> Result<Self, PlaceError> {
        if !text.contains("://") {
            fs::create_dir_all(text).map_err(|source| PlaceError::Folder { path: text.into(), source })?;
        }
        Self::at(text)
    }

    /// A fleet to read.
    ///
    /// # Errors
    /// If the address is wrong, or the folder is not there.
    pub fn at(text: &str) -> Result<Self, PlaceError> {
        let address = |problem: String| PlaceError::Address { url: text.to_owned(), problem };
        let url = if text.contains("://") {
            Url::parse(text).map_err(|error| address(error.to_string()))?
        } else {
            if !std::path::Path::new(text).is_dir() {
                return Err(PlaceError::NoFolder { path: text.into() });
            }
            let path =
                fs::canonicalize(text).map_err(|source| PlaceError::Folder { path: text.into(), source })?;
            Url::from_directory_path(&path).map_err(|()| address("the path is not absolute".to_owned()))?
        };
        let keys = std::env::vars().filter(|(name, _)| name.starts_with("AWS_"));
        let (store, folder) =
            object_store::parse_url_opts(&url, keys.map(|(name, key)| (name.to_lowercase(), key)))
                .map_err(|error| address(error.to_string()))?;
        Ok(Self { url, store: Arc::from(store), folder })
    }

    /// A folder of any store: the path of `url`.
    ///
    /// # Errors
    /// If the path of `url` is none of an object store.
    pub fn of(store: Arc<dyn ObjectStore>, url: Url) -> Result<Self, PlaceError> {
        let folder = Path::from_url_path(url.path())
            .map_err(|error| PlaceError::Address { url: url.to_string(), problem: error.to_string() })?;
        Ok(Self { url, store, folder })
    }

    /// Its address.
    pub fn url(&self) -> &Url {
        &self.url
    }

    /// The store that it is in.
    pub fn store(&self) -> &Arc<dyn ObjectStore> {
        &self.store
    }

    /// The path in the store of the run's file. Characters that no path may have are escaped.
    pub(crate) fn of_run(&self, rig: &str, date: &str, run: &str) -> Path {
        let folder = self.folder.clone().join(format!("rig={rig}")).join(format!("date={date}"));
        folder.join(format!("{run}.parquet"))
    }

    /// The parts of a file's path below the fleet's folder.
    pub(crate) fn in_fleet(&self, path: &Path) -> Vec<String> {
        path.parts().skip(self.folder.parts().count()).map(|part| part.as_ref().to_owned()).collect()
    }

    /// The files of all runs, in order of their paths.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub async fn files(&self) -> Result<Vec<ObjectMeta>, PlaceError> {
        let all = self.store.list(Some(&self.folder));
        let of_runs = all.try_filter(|file| std::future::ready(is_of_run(&file.location))).boxed();
        let mut files: Vec<ObjectMeta> =
            of_runs.try_collect().await.map_err(|source| self.refused(source))?;
        files.sort_by(|one, other| one.location.cmp(&other.location));
        Ok(files)
    }

    /// Refuses a fleet without runs.
    pub(crate) async fn check_holds_runs(&self) -> Result<(), PlaceError> {
        let mut files = self.store.list(Some(&self.folder));
        while let Some(file) = files.try_next().await.map_err(|source| self.refused(source))? {
            if is_of_run(&file.location) {
                return Ok(());
            }
        }
        Err(PlaceError::Empty { url: self.url.to_string() })
    }

    pub(crate) fn refused(&self, source: object_store::Error) -> PlaceError {
        PlaceError::Store { url: self.url.to_string(), source: Box::new(source) }
    }
}

/// True for `.../rig=NAME/date=DATE/RUN.parquet`.
fn is_of_run(path: &Path) -> bool {
    let parts: Vec<_> = path.parts().collect();
    let is = |back: usize, start: &str| {
        parts
            .len()
            .checked_sub(back)
            .and_then(|at| parts.get(at))
            .is_some_and(|part| part.as_ref().starts_with(start))
    };
    path.extension() == Some("parquet") && is(2, "date=") && is(3, "rig=")
}
