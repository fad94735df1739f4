//! Tables of numbers as they are sent.

use bincode::{Decode, Encode};

/// What the numbers of a table are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Dtype {
    /// A byte that is 0 or 1.
    Bool,
    /// Unsigned bytes.
    U8,
    /// Signed bytes.
    I8,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 64 bits.
    I64,
    /// Floats of 32 bits.
    F32,
    /// Floats of 64 bits.
    F64,
}

impl Dtype {
    /// Its number on the wire; 3, 4, 6 and 7 stand for 16-bit numbers, i32 and u64, which no table has yet.
    #[must_use]
    pub fn number(self) -> u8 {
        match self {
            Self::Bool => 0,
            Self::U8 => 1,
            Self::I8 => 2,
            Self::U32 => 5,
            Self::I64 => 8,
            Self::F32 => 9,
            Self::F64 => 10,
        }
    }

    /// The type of that number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        [Self::Bool, Self::U8, Self::I8, Self::U32, Self::I64, Self::F32, Self::F64]
            .into_iter()
            .find(|dtype| dtype.number() == number)
    }

    /// Bytes of one number.
    #[must_use]
    pub fn bytes(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }
}

/// One table of an observation, an action or an info: what it is for one environment. On the wire it is its numbers,
/// little-endian, row by row, one row an environment.
#[derive(Debug, Clone, PartialEq, Eq, Encode, Decode)]
pub struct Leaf {
    /// Its name; the names of nested tables are joined by `/`.
    pub name: String,
    /// The number of its [`Dtype`].
    pub dtype: u8,
    /// Its shape for one environment.
    pub shape: Vec<u32>,
}

impl Leaf {
    /// A table of that name.
    #[must_use]
    pub fn new(name: &str, dtype: Dtype, shape: &[u32]) -> Self {
        Self { name: name.to_owned(), dtype: dtype.number(), shape: shape.to_vec() }
    }

    /// Bytes of one row; `None` if the type is unknown or the row too large.
    #[must_use]
    pub fn row_bytes(&self) -> Option<usize> {
        let size = Dtype::from_number(self.dtype)?.bytes();
        self.shape.iter().try_fold(size, |bytes, &side| bytes.checked_mul(side as usize))
    }
}
