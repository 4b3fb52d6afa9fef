//! Everything that can go wrong on the whole path, in sentences an artist can act on.

use std::path::PathBuf;

/// Errors of the whole path. Nothing was written or changed when one is returned.
#[derive(Debug, thiserror::Error)]
pub enum FacewrightError {
    /// A file could not be read.
    #[error("{path} cannot be read: {reason}")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system or the decoder said.
        reason: String,
    },
    /// A file could not be written.
    #[error("{path} cannot be written: {reason}. Nothing was changed")]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// No picture among the inputs.
    #[error("no pictures in {input}: give image files, a folder of images, or a video")]
    NoFrames {
        /// What was given.
        input: String,
    },
    /// A folder of pictures of kinds that are not read.
    #[error("{input} holds {kind} pictures, which are not read here: {remedy}")]
    ForeignPictures {
        /// The folder.
        input: String,
        /// Their kind.
        kind: &'static str,
        /// What to do with them.
        remedy: &'static str,
    },
    /// A folder of videos, and no pictures.
    #[error("{input} holds no pictures but {video}, a video: give the video itself")]
    VideoInFolder {
        /// The folder.
        input: String,
        /// The first of them.
        video: PathBuf,
    },
    /// Pictures of different sizes.
    #[error(
        "of {frames} frames all must have one size, that of one camera, and these are not {width}x{height} as most are: {odd}"
    )]
    MixedSizes {
        /// The odd ones, with their sizes.
        odd: String,
        /// Number of frames.
        frames: usize,
        /// Width of most frames, pixels.
        width: u32,
        /// Height of most frames, pixels.
        height: u32,
    },
    /// Pictures that would be written among those they are made from.
    #[error("{folder} holds the originals themselves, which are never overwritten: give another folder to write to")]
    OwnFolder {
        /// The folder.
        folder: PathBuf,
    },
    /// A result and frames that have nothing to do with each other.
    #[error("none of these frames is in {path}, whose frames are {first} to {last}: give the frames it was made from")]
    OtherFrames {
        /// The report.
        path: PathBuf,
        /// Name of its first frame.
        first: String,
        /// Name of its last frame.
        last: String,
    },
    /// A lens that shows less than its picture.
    #[error("the camera's lens {what}: calibrate again, or correct k1, k2, k3, p1 and p2 in its file")]
    Lens {
        /// What it does that no lens does.
        what: String,
    },
    /// A video without a decoder.
    #[error("{path} is a video, and no ffmpeg was found on the PATH: install ffmpeg, or give the frames as images")]
    NoFfmpeg {
        /// The video.
        path: PathBuf,
    },
    /// A video whose frames find no room while they are read.
    #[error(
        "the frames of {path} do not fit into the temporary folder {folder}: make room there, or set {variable} to a folder with more"
    )]
    TemporaryFull {
        /// The video.
        path: PathBuf,
        /// Where its frames were to be kept.
        folder: PathBuf,
        /// The variable that names the folder.
        variable: &'static str,
    },
    /// A temporary folder in which nothing can be made.
    #[error(
        "the temporary folder {folder}, for the frames of videos, cannot be written to: {reason}. Set {variable} to another"
    )]
    NoTemporary {
        /// The folder.
        folder: PathBuf,
        /// What the system said.
        reason: String,
        /// The variable that names the folder.
        variable: &'static str,
    },
    /// Too few frames.
    #[error("only one frame: film the head while it turns to both sides, and give at least two frames")]
    OneFrame,
    /// No face anywhere.
    #[error(
        "no face was found in any of the {frames} frames: film the head upright, well lit and large in the picture"
    )]
    NoFace {
        /// Frames searched.
        frames: usize,
    },
    /// Too few frames are usable.
    #[error(
        "only {usable} of {frames} frames can be used ({reasons}): film the face in focus, uncovered and with a neutral expression"
    )]
    TooFewUsable {
        /// Usable frames.
        usable: usize,
        /// All frames.
        frames: usize,
        /// How often each reason occurred.
        reasons: String,
    },
    /// Something was measured on the head or its film that no head can be made with.
    #[error("no head was made: {reason}")]
    ImpossibleHead {
        /// What was measured, what is usual, and what helps.
        reason: String,
    },
    /// The head does not turn.
    #[error("the head turns by only {degrees:.0}°, too little to measure depth: turn it at least 15° to each side")]
    NoRotation {
        /// Range of yaw, degrees.
        degrees: f64,
    },
    /// The picture of the head grows, but it does not turn.
    #[error(
        "the head grows by {:.0} % in the picture but turns by only {degrees:.0}°: neither zooming nor moving closer shows its depth. Keep the zoom fixed and turn the head at least 15° to each side",
        100.0 * (growth - 1.0)
    )]
    OnlyZoom {
        /// Largest size over the smallest.
        growth: f64,
        /// Range of yaw, degrees.
        degrees: f64,
    },
    /// The camera belongs to other pictures.
    #[error(
        "the camera was calibrated at {camera_width}x{camera_height} but the frames are {width}x{height}: calibrate at the size and orientation in which you film"
    )]
    OtherCamera {
        /// Width in camera.json.
        camera_width: u32,
        /// Height in camera.json.
        camera_height: u32,
        /// Width of the frames.
        width: u32,
        /// Height of the frames.
        height: u32,
    },
    /// No board found in any picture, or too few.
    #[error("the board was found in {found} of {pictures} pictures and at least 3 are needed: {hint}")]
    TooFewBoards {
        /// Pictures with a board.
        found: usize,
        /// All pictures.
        pictures: usize,
        /// What the detector said of the others.
        hint: String,
    },
    /// Pictures of a rig that cannot be matched by moment.
    #[error(
        "every camera of a rig needs one picture per moment, with the same number at the end of its name or in the same order: {counts}"
    )]
    RigPictures {
        /// Pictures of each camera.
        counts: String,
    },
    /// A camera that a rig does not have.
    #[error("the rig has no camera {name}: its cameras are {known}")]
    RigCamera {
        /// Its name.
        name: String,
        /// Those that it has.
        known: String,
    },
    /// Clips of a rig that do not show one head at the same moments.
    #[error(
        "the clips of {a} and {b} do not show the same moments, or the rig was moved: {reason}. Trim them to start at the same moment"
    )]
    RigMoments {
        /// One camera.
        a: String,
        /// The other.
        b: String,
        /// What is wrong with them.
        reason: String,
    },
    /// Cameras of a rig that see the head from one direction.
    #[error(
        "the cameras see the head from directions only {degrees:.1}° apart, too little to measure depth: set them up 10° to 25° apart as seen from the head, and calibrate the rig again"
    )]
    RigNarrow {
        /// Angle between the directions, degrees.
        degrees: f64,
    },
    /// A result of a rig, with the frames of one camera.
    #[error(
        "this head was made from the clips of several cameras: give the frames of each, like {first}=DIR; its cameras are {known}"
    )]
    RigResult {
        /// Name of the first one.
        first: String,
        /// All of them.
        known: String,
    },
    /// An option that makes no sense.
    #[error("{name} must be {expected}")]
    Option {
        /// The option.
        name: &'static str,
        /// What it may be.
        expected: &'static str,
    },
    /// A result folder without a result.
    #[error("{path} holds no result of `facewright reconstruct`: {reason}")]
    NoResult {
        /// The folder.
        path: PathBuf,
        /// What is missing.
        reason: String,
    },
    /// The generic head or the nets are missing.
    #[error(
        "{path} is missing: set FACEWRIGHT_ASSETS, or --assets, to the folder `assets` that came with Facewright; it holds generic_head.safetensors.gz and nets/"
    )]
    NoAssets {
        /// What was looked for.
        path: PathBuf,
    },
    /// A match of two frames failed.
    #[error("too few matches between the two frames ({found}): they must show the same face, turned by 5° to 25°")]
    TooFewMatches {
        /// Matches found.
        found: usize,
    },
    /// Faces that cannot be used.
    #[error("these faces do not belong to this clip: {reason}")]
    Faces {
        /// What is wrong with them.
        reason: String,
    },
    /// Tracks that cannot be used.
    #[error("these tracks do not belong to this clip: {reason}")]
    Tracks {
        /// What is wrong with them.
        reason: String,
    },
    /// A motion that cannot be used.
    #[error("this motion does not belong to this clip: {reason}")]
    OtherMotion {
        /// What is wrong with it.
        reason: String,
    },
    /// A measured length between points that are not fixed.
    #[error("point {id} has no fixed place on the head: measure between two points that the motion marks as fixed")]
    Length {
        /// Number of the point's track.
        id: usize,
    },
    /// Tracks without an interpupillary distance.
    #[error("these tracks do not say how far apart the pupils are: track again, or give a length between two points")]
    NoPupils,
    /// No frame of the clip has the name.
    #[error("no frame with a face is named {name}: the frames are {first} to {last}")]
    NoSuchFrame {
        /// The name.
        name: String,
        /// Name of the first frame.
        first: String,
        /// Name of the last frame.
        last: String,
    },
    /// From the landmark nets.
    #[error(transparent)]
    Landmarks(#[from] vision::landmarks::LandmarkError),
    /// From the corners.
    #[error(transparent)]
    Corners(#[from] vision::corners::CornerError),
    /// From the tracker.
    #[error(transparent)]
    Tracker(#[from] vision::track::TrackError),
    /// From the correction of matches.
    #[error(transparent)]
    Correction(#[from] vision::correct::CorrectError),
    /// From the camera.
    #[error(transparent)]
    Camera(#[from] geometry::CameraError),
    /// From calibration.
    #[error(transparent)]
    Calibrate(#[from] motion::calibrate::CalibrateError),
    /// From the calibration of a rig.
    #[error(transparent)]
    Rig(#[from] motion::calibrate::rig::RigError),
    /// From motion and structure.
    #[error(transparent)]
    Motion(#[from] motion::MotionError),
    /// From the head.
    #[error(transparent)]
    Head(#[from] head::HeadError),
    /// From the interpolation of the feature points.
    #[error(transparent)]
    Interpolation(#[from] geometry::rbf::RbfError),
    /// From the texture.
    #[error(transparent)]
    Texture(#[from] texture::TextureError),
    /// From a drawing.
    #[error(transparent)]
    Drawing(#[from] drawing::DrawingError),
    /// The printed board does not fit.
    #[error(transparent)]
    Board(#[from] crate::board_error::BoardPatternError),
    /// The caller asked to stop.
    #[error(transparent)]
    Cancelled(#[from] geometry::Cancelled),
}
