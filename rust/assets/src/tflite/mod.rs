//! Turns the nets from TensorFlow Lite files into ONNX files.
//!
//! # Entry point
//! [`tflite_to_onnx`].
//!
//! # Conventions
//! TensorFlow Lite keeps pictures channels last, `[batch, height, width, channels]`; ONNX keeps them channels first.
//! Inputs and outputs with four axes therefore come out as `[batch, channels, height, width]`; all others keep their
//! shape and order. Inputs and outputs keep their positions; their names are not kept. Half precision weights become
//! single precision.

mod flatbuffer;
mod onnx;
mod schema;
mod translate;

/// Why a net cannot be translated.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TfliteError {
    /// The file has another format.
    #[error("this is not a TensorFlow Lite file (it lacks the mark TFL3): check the package it came from")]
    NotTflite,
    /// An offset leads out of the file.
    #[error("the net's file is damaged or cut short (byte {at}): fetch the package again")]
    Damaged {
        /// Where reading failed.
        at: usize,
    },
    /// More or fewer than one graph.
    #[error("the net's file has {count} graphs, we translate files with one")]
    Graphs {
        /// How many.
        count: usize,
    },
    /// A tensor is named that does not exist.
    #[error("the net's file refers to tensor {index}, which it does not have")]
    NoSuchTensor {
        /// Its position.
        index: usize,
    },
    /// A stored value of an unknown type.
    #[error("the net stores values of TensorFlow Lite type {code}, we read types 0, 1 and 2 (f32, f16, i32)")]
    UnknownType {
        /// The schema's code.
        code: u8,
    },
    /// An operator we do not translate.
    #[error(
        "the net uses TensorFlow Lite operator {code}, which has no translation yet: add it in tflite/translate.rs"
    )]
    UnknownOperator {
        /// The schema's `BuiltinOperator` code.
        code: i32,
    },
    /// An operator with a name that we do not translate.
    #[error("the net uses the custom operator {name}, which has no translation yet: add it in tflite/translate.rs")]
    UnknownCustom {
        /// Its name.
        name: String,
    },
    /// An activation we do not translate.
    #[error("the net uses TensorFlow Lite activation {code}, which has no translation yet")]
    UnknownActivation {
        /// The schema's `ActivationFunctionType` code.
        code: u8,
    },
    /// A stride, dilation or filter size that is not positive.
    #[error("the net has a window with the impossible size or step {number}")]
    BadWindow {
        /// The number.
        number: i32,
    },
    /// An operator lacks an input or has one of an unexpected form.
    #[error("operator {operator} of the net has no usable {what}")]
    BadOperator {
        /// Its position in the net.
        operator: usize,
        /// What is missing.
        what: &'static str,
    },
}

/// The ONNX file of a TensorFlow Lite file.
///
/// # Errors
/// [`TfliteError`] when the file is damaged or uses what we do not translate.
pub fn tflite_to_onnx(bytes: &[u8]) -> Result<Vec<u8>, TfliteError> {
    translate::to_onnx(&schema::Model::read(bytes)?)
}
