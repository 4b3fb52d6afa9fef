//! The part of the TensorFlow Lite schema that our nets use, as plain structs.
//!
//! Field numbers, enum values and defaults are those of TensorFlow's `schema.fbs` (version 3).

use super::{TfliteError, flatbuffer::Table};

/// A net: one graph, its tensors and operators in order of execution.
pub struct Model {
    /// All tensors; operators refer to them by position.
    pub tensors: Vec<Tensor>,
    /// Operators, each after those it depends on.
    pub operators: Vec<Operator>,
    /// Tensors the caller fills.
    pub inputs: Vec<usize>,
    /// Tensors the caller reads.
    pub outputs: Vec<usize>,
}

/// A tensor; channels last where it is a picture.
pub struct Tensor {
    /// Sizes, `[batch, height, width, channels]` for pictures.
    pub shape: Vec<usize>,
    /// Its value, when the file stores one.
    pub constant: Option<Constant>,
}

/// A stored value.
#[derive(Clone)]
pub enum Constant {
    /// Weights; half precision is widened when read.
    Floats(Vec<f32>),
    /// Shapes and paddings.
    Ints(Vec<i32>),
}

/// The code of operators that go by a name.
const CUSTOM: i32 = 32;

/// One step of the net.
pub struct Operator {
    /// What it computes.
    pub kind: Kind,
    /// Tensors it reads; `None` for an optional one left out.
    pub inputs: Vec<Option<usize>>,
    /// Tensors it writes.
    pub outputs: Vec<usize>,
}

/// How a window may reach over the border.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Padding {
    /// Output size = input size / stride, rounded up; the border is filled.
    Same,
    /// Only whole windows.
    Valid,
}

/// A moving window over rows and columns.
#[derive(Clone, Copy, Debug)]
pub struct Window {
    /// Border rule.
    pub padding: Padding,
    /// Steps, `[rows, columns]`.
    pub stride: [usize; 2],
    /// Spacing of the taps, `[rows, columns]`.
    pub dilation: [usize; 2],
}

/// A function fused to the end of an operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Activation {
    /// Nothing.
    None,
    /// max(x, 0).
    Relu,
}

/// The operators we translate.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Sum of two tensors.
    Add(Activation),
    /// Mean of a window of `[rows, columns]`, as far as it lies within the picture.
    AveragePool2d(Window, [usize; 2], Activation),
    /// Joining along an axis (counted channels last).
    Concatenation(i32, Activation),
    /// Convolution; weights `[out, rows, columns, in]`.
    Conv2d(Window, Activation),
    /// Convolution of every channel alone; weights `[1, rows, columns, channels]`.
    DepthwiseConv2d(Window, Activation),
    /// Widening of stored half precision weights.
    Dequantize,
    /// x · min(max(x + 3, 0), 6) / 6.
    HardSwish,
    /// 1 / (1 + exp(−x)).
    Logistic,
    /// Largest value in a window of `[rows, columns]`.
    MaxPool2d(Window, [usize; 2], Activation),
    /// Product of two tensors.
    Mul(Activation),
    /// Zeros around; paddings in the second input, `[axes, 2]`.
    Pad,
    /// max(x, 0) + slope · min(x, 0).
    Prelu,
    /// max(x, 0).
    Relu,
    /// The same numbers, channels last, in another shape.
    Reshape,
    /// Bilinear resizing.
    ResizeBilinear {
        /// Corner pixels are mapped to corner pixels.
        align_corners: bool,
        /// Pixel centres lie at halves.
        half_pixel_centers: bool,
    },
    /// MediaPipe's `Convolution2DTransposeBias`: every pixel adds its window of weights `[out, rows, columns, in]` to the
    /// result, which begins with the bias.
    TransposeConv2d(Window),
}

impl Model {
    /// Reads a `.tflite` file.
    pub fn read(file: &[u8]) -> Result<Self, TfliteError> {
        if file.get(4..8) != Some(b"TFL3") {
            return Err(TfliteError::NotTflite);
        }
        let root = Table::root(file)?;
        let (codes, graphs, buffers) = (root.tables(1)?, root.tables(2)?, root.tables(4)?);
        let [graph] = graphs.as_slice() else { return Err(TfliteError::Graphs { count: graphs.len() }) };
        let tensors = graph.tables(0)?.iter().map(|t| read_tensor(t, &buffers)).collect::<Result<Vec<_>, _>>()?;
        let operators = graph.tables(3)?.iter().map(|o| read_operator(o, &codes)).collect::<Result<Vec<_>, _>>()?;
        let model = Self { inputs: indices(graph, 1)?, outputs: indices(graph, 2)?, tensors, operators };
        model.check_indices()?;
        Ok(model)
    }

    /// Every tensor that is named must exist.
    fn check_indices(&self) -> Result<(), TfliteError> {
        let of_operators = self.operators.iter().flat_map(|o| o.inputs.iter().flatten().chain(&o.outputs));
        let mut all = self.inputs.iter().chain(&self.outputs).chain(of_operators);
        match all.find(|&&i| i >= self.tensors.len()) {
            Some(&index) => Err(TfliteError::NoSuchTensor { index }),
            None => Ok(()),
        }
    }
}

fn indices(table: &Table, id: usize) -> Result<Vec<usize>, TfliteError> {
    let index = |i: i32| usize::try_from(i).map_err(|_| TfliteError::NoSuchTensor { index: usize::MAX });
    table.ints(id)?.into_iter().map(index).collect()
}

fn read_tensor(tensor: &Table, buffers: &[Table]) -> Result<Tensor, TfliteError> {
    let shape = tensor.ints(0)?.into_iter().map(|n| usize::try_from(n).unwrap_or(1)).collect();
    let buffer = buffers.get(tensor.index(2, 0)?).map_or(Ok(&[][..]), |b| b.bytes(0))?;
    if buffer.is_empty() {
        return Ok(Tensor { shape, constant: None });
    }
    let constant = match tensor.byte(1, 0)? {
        0 => Constant::Floats(words(buffer).map(f32::from_le_bytes).collect()),
        1 => Constant::Floats(words(buffer).map(|w| half_to_f32(u16::from_le_bytes(w))).collect()),
        2 => Constant::Ints(words(buffer).map(i32::from_le_bytes).collect()),
        code => return Err(TfliteError::UnknownType { code }),
    };
    Ok(Tensor { shape, constant: Some(constant) })
}

fn words<const N: usize>(bytes: &[u8]) -> impl Iterator<Item = [u8; N]> + '_ {
    bytes.as_chunks().0.iter().copied()
}

/// An IEEE 754 half precision number, exactly.
fn half_to_f32(half: u16) -> f32 {
    let sign = if half >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from((half >> 10) & 31), f32::from(half & 1023));
    sign * match exponent {
        0 => fraction * 2f32.powi(-24),
        31 if fraction == 0.0 => f32::INFINITY,
        31 => f32::NAN,
        _ => (1.0 + fraction / 1024.0) * 2f32.powi(exponent - 15),
    }
}

fn read_operator(operator: &Table, codes: &[Table]) -> Result<Operator, TfliteError> {
    let code = codes.get(operator.index(0, 0)?).ok_or(TfliteError::Damaged { at: 0 })?;
    // Files from before 2020 have the code in a byte; later ones repeat it there as far as it fits.
    let builtin = code.int(3, 0)?.max(i32::from(code.byte(0, 0)?));
    let inputs = operator.ints(1)?.into_iter().map(|i| usize::try_from(i).ok()).collect();
    let kind = match builtin {
        CUSTOM => read_custom(code.bytes(1)?, operator.bytes(5)?)?,
        _ => read_kind(builtin, operator.table(4)?)?,
    };
    Ok(Operator { kind, inputs, outputs: indices(operator, 2)? })
}

/// An operator that the file knows by name. Its options are the bytes of the C structure that its code reads:
/// `TfLiteTransposeConvParams` is padding (1 same, 2 valid), stride of columns, stride of rows.
fn read_custom(name: &[u8], options: &[u8]) -> Result<Kind, TfliteError> {
    if name != b"Convolution2DTransposeBias" {
        return Err(TfliteError::UnknownCustom { name: String::from_utf8_lossy(name).into_owned() });
    }
    let numbers: Vec<i32> = words(options).map(i32::from_le_bytes).collect();
    let &[padding, columns, rows, ..] = numbers.as_slice() else { return Err(TfliteError::BadWindow { number: 0 }) };
    let padding = match padding {
        1 => Padding::Same,
        2 => Padding::Valid,
        number => return Err(TfliteError::BadWindow { number }),
    };
    Ok(Kind::TransposeConv2d(Window { padding, stride: [positive(rows)?, positive(columns)?], dilation: [1, 1] }))
}

fn read_kind(builtin: i32, options: Option<Table>) -> Result<Kind, TfliteError> {
    let byte = |id: usize| options.map_or(Ok(0), |t| t.byte(id, 0));
    let int = |id: usize, default: i32| options.map_or(Ok(default), |t| t.int(id, default));
    let activation = |id: usize| read_activation(byte(id)?);
    Ok(match builtin {
        0 => Kind::Add(activation(0)?),
        1 => Kind::AveragePool2d(read_window(options, None)?, read_filter(options)?, activation(5)?),
        2 => Kind::Concatenation(int(0, 0)?, activation(1)?),
        3 => Kind::Conv2d(read_window(options, Some(4))?, activation(3)?),
        4 => Kind::DepthwiseConv2d(read_window(options, Some(5))?, activation(4)?),
        6 => Kind::Dequantize,
        14 => Kind::Logistic,
        17 => Kind::MaxPool2d(read_window(options, None)?, read_filter(options)?, activation(5)?),
        18 => Kind::Mul(activation(0)?),
        19 => Kind::Relu,
        22 => Kind::Reshape,
        23 => Kind::ResizeBilinear { align_corners: byte(2)? != 0, half_pixel_centers: byte(3)? != 0 },
        34 => Kind::Pad,
        54 => Kind::Prelu,
        117 => Kind::HardSwish,
        code => return Err(TfliteError::UnknownOperator { code }),
    })
}

fn positive(number: i32) -> Result<usize, TfliteError> {
    usize::try_from(number).ok().filter(|&n| n > 0).ok_or(TfliteError::BadWindow { number })
}

/// The window fields shared by convolutions and pooling; column fields come before row fields.
fn read_window(options: Option<Table>, dilation_id: Option<usize>) -> Result<Window, TfliteError> {
    let Some(table) = options else { return Err(TfliteError::BadWindow { number: 0 }) };
    let padding = if table.byte(0, 0)? == 0 { Padding::Same } else { Padding::Valid };
    let stride = [positive(table.int(2, 0)?)?, positive(table.int(1, 0)?)?];
    let dilation = match dilation_id {
        Some(id) => [positive(table.int(id + 1, 1)?)?, positive(table.int(id, 1)?)?],
        None => [1, 1],
    };
    Ok(Window { padding, stride, dilation })
}

/// Size of a pooling window, `[rows, columns]`.
fn read_filter(options: Option<Table>) -> Result<[usize; 2], TfliteError> {
    let size = |id: usize| positive(options.map_or(Ok(0), |table| table.int(id, 0))?);
    Ok([size(4)?, size(3)?])
}

fn read_activation(code: u8) -> Result<Activation, TfliteError> {
    match code {
        0 => Ok(Activation::None),
        1 => Ok(Activation::Relu),
        code => Err(TfliteError::UnknownActivation { code }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_precision_is_widened_exactly() {
        let cases =
            [(0x3c00, 1.0), (0xc000, -2.0), (0x7bff, 65504.0), (0x0001, 5.960_464_5e-8), (0x3555, 0.333_251_95)];
        for (half, value) in cases {
            assert_eq!(half_to_f32(half), value);
        }
    }

    #[test]
    fn other_files_are_refused() {
        assert!(matches!(Model::read(b"PK\x03\x04something"), Err(TfliteError::NotTflite)));
    }

    #[test]
    fn unknown_operators_are_named_by_their_code_or_their_name() {
        assert!(matches!(read_kind(25, None), Err(TfliteError::UnknownOperator { code: 25 })));
        let error = read_custom(b"TransformLandmarks", &[]).unwrap_err().to_string();
        assert!(error.contains("TransformLandmarks"), "{error}");
    }

    #[test]
    fn the_options_of_a_transposed_convolution_are_a_c_structure() {
        let options: Vec<u8> = [1i32, 3, 2].iter().flat_map(|n| n.to_le_bytes()).collect();
        let kind = read_custom(b"Convolution2DTransposeBias", &options).unwrap();
        let Kind::TransposeConv2d(window) = kind else { unreachable!("{kind:?}") };
        assert_eq!((window.padding, window.stride), (Padding::Same, [2, 3]));
        for bad in [&options[..8], &[0; 12]] {
            let found = read_custom(b"Convolution2DTransposeBias", bad);
            assert!(matches!(found, Err(TfliteError::BadWindow { number: 0 })));
        }
    }
}
