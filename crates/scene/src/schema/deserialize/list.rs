//! The items of a list.

use serde::de::{DeserializeSeed, Deserializer, SeqAccess, Visitor};

use crate::error_code::ErrorCode;
use crate::schema::deserialize::error::DeError;

/// Visits a list of `length` items, and checks that the visitor read all of them.
pub fn visit_list<'de, I, F, V>(length: usize, item: F, visitor: V) -> Result<V::Value, DeError>
where
    I: Deserializer<'de, Error = DeError>,
    F: Fn(usize) -> I,
    V: Visitor<'de>,
{
    let mut list = ListAccess { item, length, next: 0 };
    let value = visitor.visit_seq(&mut list)?;
    if list.next < length {
        let wanted = list.next;
        return Err(DeError::new(
            ErrorCode::WrongShape.message(format!("a list of length {length}; expected a list of length {wanted}")),
        ));
    }
    Ok(value)
}

/// The items of a list in order.
struct ListAccess<F> {
    item: F,
    length: usize,
    next: usize,
}

impl<'de, I: Deserializer<'de, Error = DeError>, F: Fn(usize) -> I> SeqAccess<'de> for &mut ListAccess<F> {
    type Error = DeError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, DeError> {
        if self.next == self.length {
            return Ok(None);
        }
        let i = self.next;
        self.next += 1;
        seed.deserialize((self.item)(i)).map(Some).map_err(|fault| fault.in_segment(format!("[{i}]"), &None))
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.length - self.next)
    }
}
