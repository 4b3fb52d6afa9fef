//! Writes ONNX files: as much of the format as the translated nets need.
//!
//! ONNX is protobuf: a message is a run of fields, each a key `(number << 3) | wire type`, then a varint
//! (wire type 0), four bytes (5) or a length and that many bytes (2).
//! Field numbers are those of `onnx.proto3`; the operator set is version 14.

/// Version of the operator definitions the nodes follow.
const OPERATOR_SET: u64 = 14;
/// Version of the file format that belongs to that operator set.
const IR_VERSION: u64 = 7;

/// A protobuf message under construction.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn varint(&mut self, mut number: u64) {
        while number >= 0x80 {
            self.0.push((number & 0x7f) as u8 | 0x80);
            number >>= 7;
        }
        self.0.push(number as u8);
    }

    fn number(mut self, field: u64, value: u64) -> Self {
        self.varint(field << 3);
        self.varint(value);
        self
    }

    fn bytes(mut self, field: u64, value: &[u8]) -> Self {
        self.varint(field << 3 | 2);
        self.varint(value.len() as u64);
        self.0.extend_from_slice(value);
        self
    }

    fn message(self, field: u64, value: &Message) -> Self {
        self.bytes(field, &value.0)
    }

    fn messages(self, field: u64, values: &[Message]) -> Self {
        values.iter().fold(self, |message, value| message.message(field, value))
    }
}

/// A named setting of a node.
pub enum Attribute<'a> {
    /// One whole number.
    Int(&'a str, i64),
    /// Several whole numbers.
    Ints(&'a str, Vec<i64>),
    /// A word.
    Word(&'a str, &'a str),
}

impl Attribute<'_> {
    fn encode(&self) -> Message {
        let named = |name: &str| Message::default().bytes(1, name.as_bytes());
        match self {
            Attribute::Int(name, value) => named(name).number(3, *value as u64).number(20, 2),
            Attribute::Ints(name, values) => {
                values.iter().fold(named(name), |message, &v| message.number(8, v as u64)).number(20, 7)
            }
            Attribute::Word(name, value) => named(name).bytes(4, value.as_bytes()).number(20, 3),
        }
    }
}

/// An ONNX graph under construction. Values are known by name.
#[derive(Default)]
pub struct Graph {
    nodes: Vec<Message>,
    constants: Vec<Message>,
    inputs: Vec<Message>,
    outputs: Vec<Message>,
}

impl Graph {
    /// Adds a node.
    pub fn node(&mut self, operator: &str, inputs: &[&str], output: &str, attributes: &[Attribute]) {
        let mut node = Message::default();
        for input in inputs {
            node = node.bytes(1, input.as_bytes());
        }
        node = node.bytes(2, output.as_bytes()).bytes(4, operator.as_bytes());
        self.nodes.push(attributes.iter().fold(node, |node, a| node.message(5, &a.encode())));
    }

    /// Adds a constant of floats.
    pub fn floats(&mut self, name: &str, shape: &[usize], values: &[f32]) {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(name, shape, 1, &raw);
    }

    /// Adds a constant list of whole numbers.
    pub fn ints(&mut self, name: &str, values: &[i64]) {
        let raw: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        self.constant(name, &[values.len()], 7, &raw);
    }

    fn constant(&mut self, name: &str, shape: &[usize], data_type: u64, raw: &[u8]) {
        let dims = shape.iter().fold(Message::default(), |message, &n| message.number(1, n as u64));
        self.constants.push(dims.number(2, data_type).bytes(8, name.as_bytes()).bytes(9, raw));
    }

    /// Declares a value the caller fills.
    pub fn input(&mut self, name: &str, shape: &[usize]) {
        self.inputs.push(float_value(name, shape));
    }

    /// Declares a value the caller reads.
    pub fn output(&mut self, name: &str, shape: &[usize]) {
        self.outputs.push(float_value(name, shape));
    }

    /// The whole file.
    pub fn into_file(self) -> Vec<u8> {
        let graph = Message::default()
            .messages(1, &self.nodes)
            .bytes(2, b"net")
            .messages(5, &self.constants)
            .messages(11, &self.inputs)
            .messages(12, &self.outputs);
        let operators = Message::default().bytes(1, b"").number(2, OPERATOR_SET);
        Message::default().number(1, IR_VERSION).bytes(2, b"facewright").message(7, &graph).message(8, &operators).0
    }
}

/// A name with the type "floats of this shape".
fn float_value(name: &str, shape: &[usize]) -> Message {
    let size = |&n: &usize| Message::default().number(1, n as u64);
    let dims = Message::default().messages(1, &shape.iter().map(size).collect::<Vec<_>>());
    let tensor = Message::default().number(1, 1).message(2, &dims);
    Message::default().bytes(1, name.as_bytes()).message(2, &Message::default().message(1, &tensor))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_encoded_as_protobuf_says() {
        // The two examples of the protobuf encoding guide: 150 in field 1, "testing" in field 2.
        assert_eq!(Message::default().number(1, 150).0, [0x08, 0x96, 0x01]);
        assert_eq!(Message::default().bytes(2, b"testing").0, b"\x12\x07testing");
    }
}
