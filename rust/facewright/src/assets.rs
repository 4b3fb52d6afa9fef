//! Where the generic head and the landmark nets are.

use crate::FacewrightError;
use head::GenericHead;
use std::path::{Path, PathBuf};
use vision::landmarks::FaceLandmarker;

/// The file of the generic head in the folder of the assets.
const HEAD: &str = "generic_head.safetensors.gz";

/// The generic head and the nets, loaded.
pub struct Assets {
    /// The head that every result has the topology of.
    pub head: GenericHead,
    /// Face detector and landmark nets.
    pub landmarker: FaceLandmarker,
}

impl Assets {
    /// Loads `generic_head.safetensors.gz` and `nets/` from a folder.
    pub fn load(folder: &Path) -> Result<Self, FacewrightError> {
        Ok(Self { head: Self::load_head(folder)?, landmarker: FaceLandmarker::load(&folder.join("nets"))? })
    }

    /// Loads the generic head alone, which needs no nets.
    ///
    /// # Errors
    /// [`FacewrightError::NoAssets`] where it is not in the folder, [`FacewrightError::Head`] where it is of another version.
    pub fn load_head(folder: &Path) -> Result<GenericHead, FacewrightError> {
        let path = folder.join(HEAD);
        let bytes = std::fs::read(&path).map_err(|_| FacewrightError::NoAssets { path })?;
        Ok(GenericHead::from_bytes(&bytes)?)
    }

    /// The folder named by `FACEWRIGHT_ASSETS`, or `assets` beside the folder of the running program.
    pub fn default_folder() -> PathBuf {
        if let Some(folder) = std::env::var_os("FACEWRIGHT_ASSETS") {
            return folder.into();
        }
        let program = std::env::current_exe().unwrap_or_default();
        program.parent().and_then(Path::parent).unwrap_or(Path::new(".")).join("assets")
    }
}
