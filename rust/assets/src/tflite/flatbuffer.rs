//! A bounds-checked reader of flatbuffers, as much of the format as `.tflite` files use.
//!
//! A table starts with a signed offset back to its vtable; the vtable lists, for every field id, the field's
//! offset from the table's start, 0 when the field is absent. Vectors, strings and sub-tables are reached by
//! unsigned forward offsets. All numbers are little endian.
//! Source: the FlatBuffers internals page, <https://flatbuffers.dev/internals/>.

use super::TfliteError;

/// A table inside a flatbuffer.
#[derive(Clone, Copy)]
pub struct Table<'a> {
    bytes: &'a [u8],
    start: usize,
}

/// `N` bytes at `at`, or the place where the file breaks off.
fn read<const N: usize>(bytes: &[u8], at: usize) -> Result<[u8; N], TfliteError> {
    at.checked_add(N)
        .and_then(|end| bytes.get(at..end))
        .and_then(|slice| slice.try_into().ok())
        .ok_or(TfliteError::Damaged { at })
}

fn read_u32(bytes: &[u8], at: usize) -> Result<usize, TfliteError> {
    Ok(u32::from_le_bytes(read(bytes, at)?) as usize)
}

impl<'a> Table<'a> {
    /// The root table of a whole file.
    pub fn root(bytes: &'a [u8]) -> Result<Self, TfliteError> {
        Ok(Self { bytes, start: read_u32(bytes, 0)? })
    }

    /// Where the value of a field lies; `None` when the field is absent.
    fn field(&self, id: usize) -> Result<Option<usize>, TfliteError> {
        let back = i32::from_le_bytes(read(self.bytes, self.start)?);
        let vtable = usize::try_from(self.start as i64 - i64::from(back))
            .map_err(|_| TfliteError::Damaged { at: self.start })?;
        let vtable_size = usize::from(u16::from_le_bytes(read(self.bytes, vtable)?));
        let slot = 4 + 2 * id;
        if slot + 2 > vtable_size {
            return Ok(None);
        }
        let offset = usize::from(u16::from_le_bytes(read(self.bytes, vtable + slot)?));
        Ok((offset != 0).then_some(self.start + offset))
    }

    /// What the offset stored in a field points to.
    fn target(&self, id: usize) -> Result<Option<usize>, TfliteError> {
        self.field(id)?.map(|at| Ok(at + read_u32(self.bytes, at)?)).transpose()
    }

    /// An 8-bit field.
    pub fn byte(&self, id: usize, default: u8) -> Result<u8, TfliteError> {
        self.field(id)?.map_or(Ok(default), |at| Ok(read::<1>(self.bytes, at)?[0]))
    }

    /// A 32-bit signed field.
    pub fn int(&self, id: usize, default: i32) -> Result<i32, TfliteError> {
        self.field(id)?.map_or(Ok(default), |at| Ok(i32::from_le_bytes(read(self.bytes, at)?)))
    }

    /// A field that holds a count or an index.
    pub fn index(&self, id: usize, default: usize) -> Result<usize, TfliteError> {
        self.field(id)?.map_or(Ok(default), |at| read_u32(self.bytes, at))
    }

    /// A sub-table; `None` when absent.
    pub fn table(&self, id: usize) -> Result<Option<Self>, TfliteError> {
        Ok(self.target(id)?.map(|start| Self { bytes: self.bytes, start }))
    }

    /// A vector of sub-tables, empty when absent.
    pub fn tables(&self, id: usize) -> Result<Vec<Self>, TfliteError> {
        let Some(vector) = self.target(id)? else { return Ok(Vec::new()) };
        let count = read_u32(self.bytes, vector)?;
        (0..count)
            .map(|k| {
                let at = vector + 4 + 4 * k;
                Ok(Self { bytes: self.bytes, start: at + read_u32(self.bytes, at)? })
            })
            .collect()
    }

    /// A vector of 32-bit signed numbers, empty when absent.
    pub fn ints(&self, id: usize) -> Result<Vec<i32>, TfliteError> {
        let Some(vector) = self.target(id)? else { return Ok(Vec::new()) };
        let count = read_u32(self.bytes, vector)?;
        (0..count).map(|k| Ok(i32::from_le_bytes(read(self.bytes, vector + 4 + 4 * k)?))).collect()
    }

    /// A vector of bytes, empty when absent.
    pub fn bytes(&self, id: usize) -> Result<&'a [u8], TfliteError> {
        let Some(vector) = self.target(id)? else { return Ok(&[]) };
        let start = vector + 4;
        let end = start.checked_add(read_u32(self.bytes, vector)?);
        end.and_then(|end| self.bytes.get(start..end)).ok_or(TfliteError::Damaged { at: vector })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file whose root table has field 0 = int 7, field 1 absent, field 2 = vector of the bytes 1 2 3.
    fn sample() -> Vec<u8> {
        let mut file = Vec::new();
        file.extend(16u32.to_le_bytes()); // root table at 16
        for half in [10u16, 12, 4, 0, 8, 0] {
            file.extend(half.to_le_bytes()); // vtable at 4: its size, the table's size, three fields, filling
        }
        file.extend(12i32.to_le_bytes()); // table at 16, vtable 12 before it
        file.extend(7i32.to_le_bytes());
        file.extend(4u32.to_le_bytes()); // at 24: vector 4 further, at 28
        file.extend(3u32.to_le_bytes());
        file.extend([1, 2, 3]);
        file
    }

    #[test]
    fn fields_are_found_through_the_vtable() {
        let file = sample();
        let table = Table::root(&file).unwrap();
        assert_eq!(table.int(0, 0).unwrap(), 7);
        assert_eq!(table.int(1, 42).unwrap(), 42);
        assert_eq!(table.bytes(2).unwrap(), [1, 2, 3]);
        assert_eq!(table.int(9, -1).unwrap(), -1);
    }

    #[test]
    fn a_file_cut_short_is_an_error_not_a_panic() {
        let file = sample();
        for length in 0..file.len() {
            let cut = &file[..length];
            let all = Table::root(cut).and_then(|t| t.int(0, 0).and(t.bytes(2).map(|_| ())));
            assert!(matches!(all, Err(TfliteError::Damaged { .. })), "length {length}");
        }
    }
}
