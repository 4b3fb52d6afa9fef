//! The generic head and the nets, read once for all jobs.

use facewright::FacewrightError as CoreError;
use head::GenericHead;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

struct Shared {
    folder: PathBuf,
    loaded: Mutex<Option<Arc<facewright::Assets>>>,
}

/// Shared by those who take the assets; whoever comes first reads them.
#[derive(Clone)]
pub(crate) struct Handle(Arc<Shared>);

impl Handle {
    fn new(folder: PathBuf) -> Self {
        Self(Arc::new(Shared { folder, loaded: Mutex::new(None) }))
    }

    /// Where they are.
    pub fn folder(&self) -> &Path {
        &self.0.folder
    }

    /// The assets, read where nobody has read them yet. Others who come in the meantime wait.
    pub fn load(&self) -> Result<Arc<facewright::Assets>, CoreError> {
        let mut loaded = self.loaded();
        if let Some(assets) = &*loaded {
            return Ok(assets.clone());
        }
        let assets = Arc::new(facewright::Assets::load(&self.0.folder)?);
        *loaded = Some(assets.clone());
        Ok(assets)
    }

    /// What is made of the generic head, which is read alone where nobody has read the assets yet.
    pub fn with_head<T>(&self, make: impl FnOnce(&GenericHead) -> T) -> Result<T, CoreError> {
        let loaded = self.loaded().clone();
        Ok(match loaded {
            Some(assets) => make(&assets.head),
            None => make(&facewright::Assets::load_head(&self.0.folder)?),
        })
    }

    fn loaded(&self) -> MutexGuard<'_, Option<Arc<facewright::Assets>>> {
        self.0.loaded.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The generic head and the landmark nets in a folder, read when a job first needs them and kept for later ones.
///
/// Pass it as `assets=`, from any thread.
#[pyclass(frozen, module = "facewright")]
pub struct Assets(Handle);

#[pymethods]
impl Assets {
    #[new]
    fn new(folder: PathBuf) -> Self {
        Self(Handle::new(folder))
    }

    /// The folder of generic_head.safetensors.gz and nets/.
    #[getter]
    fn folder(&self) -> &Path {
        self.0.folder()
    }

    fn __repr__(&self) -> String {
        format!("Assets({:?})", self.0.folder())
    }
}

/// What functions take as `assets`: a handle, or a folder that is read for this job.
#[derive(FromPyObject)]
pub(crate) enum AssetsArgument<'py> {
    Handle(Bound<'py, Assets>),
    Folder(PathBuf),
}

impl AssetsArgument<'_> {
    /// What a job takes along.
    pub fn handle(self) -> Handle {
        match self {
            Self::Handle(assets) => assets.get().0.clone(),
            Self::Folder(folder) => Handle::new(folder),
        }
    }
}
