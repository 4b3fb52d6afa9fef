//! Errors by what a caller can do about them.

use crate::FacewrightError;

/// What a caller can do about an error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorGroup {
    /// Give other files to read.
    Input,
    /// Give another place to write to.
    Output,
    /// Film again, or take other frames.
    Film,
    /// Give another camera, or calibrate it from other pictures.
    Camera,
    /// Give faces, tracks or a motion that belong to the frames.
    Tracks,
    /// Choose another value of an option.
    Option,
    /// Install what is missing.
    Setup,
    /// Nothing: it was asked for.
    Cancelled,
}

impl FacewrightError {
    /// What a caller can do about it.
    pub fn group(&self) -> ErrorGroup {
        match self {
            Self::Read { .. }
            | Self::ForeignPictures { .. }
            | Self::VideoInFolder { .. }
            | Self::NoFrames { .. }
            | Self::MixedSizes { .. }
            | Self::OtherFrames { .. }
            | Self::NoResult { .. } => ErrorGroup::Input,
            Self::Write { .. } | Self::OwnFolder { .. } | Self::Drawing(_) => ErrorGroup::Output,
            Self::Option { .. }
            | Self::Board(_)
            | Self::NoSuchFrame { .. }
            | Self::Length { .. }
            | Self::Tracker(vision::track::TrackError::Window(_)) => ErrorGroup::Option,
            Self::OtherCamera { .. }
            | Self::Lens { .. }
            | Self::TooFewBoards { .. }
            | Self::RigPictures { .. }
            | Self::RigCamera { .. }
            | Self::RigMoments { .. }
            | Self::RigNarrow { .. }
            | Self::RigResult { .. }
            | Self::Camera(_)
            | Self::Calibrate(_)
            | Self::Rig(_) => ErrorGroup::Camera,
            Self::Faces { .. } | Self::Tracks { .. } | Self::OtherMotion { .. } | Self::NoPupils => ErrorGroup::Tracks,
            Self::NoFfmpeg { .. } | Self::TemporaryFull { .. } | Self::NoTemporary { .. } | Self::NoAssets { .. } => {
                ErrorGroup::Setup
            }
            Self::Cancelled(_) => ErrorGroup::Cancelled,
            // What the pictures show was too little for one of the steps.
            _ => ErrorGroup::Film,
        }
    }

    /// The variant's name in snake case: a word for programs, which stays where the sentence is reworded.
    pub fn kind(&self) -> String {
        let debug = format!("{self:?}");
        let name = debug.chars().take_while(char::is_ascii_alphanumeric);
        let mut kind = String::new();
        for letter in name {
            if letter.is_ascii_uppercase() && !kind.is_empty() {
                kind.push('_');
            }
            kind.push(letter.to_ascii_lowercase());
        }
        kind
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_are_the_variants_names() {
        let kind = |error: FacewrightError| (error.kind(), error.group());
        assert_eq!(kind(FacewrightError::OneFrame), ("one_frame".to_owned(), ErrorGroup::Film));
        let option = FacewrightError::Option { name: "x", expected: "y" };
        assert_eq!(kind(option), ("option".to_owned(), ErrorGroup::Option));
        let cancelled = FacewrightError::from(geometry::Cancelled);
        assert_eq!(kind(cancelled), ("cancelled".to_owned(), ErrorGroup::Cancelled));
        let window = FacewrightError::from(vision::track::TrackError::Window(4));
        assert_eq!(kind(window), ("tracker".to_owned(), ErrorGroup::Option));
    }
}
