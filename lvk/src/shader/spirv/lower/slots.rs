//! Places where the values of a function stay while other code runs.

use std::collections::{BTreeMap, HashMap};

use super::emit::Emitter;
use super::linker::Linker;
use super::stack_size::value_bytes;

/// Variables of the invocation that hold values of functions, as many of each type as one piece of code needs.
///
/// All pieces share them. Were each value to stay in a variable of its own, compilers would keep all in registers while
/// rays are traced: for all they know, any piece may follow any other.
#[derive(Debug, Clone, Default)]
pub(super) struct Slots {
    /// Elements of each slot, which is an array then.
    length: Option<u32>,
    /// The slots of each type of value.
    by_type: BTreeMap<u32, Vec<u32>>,
}

impl Slots {
    /// Returns slots that hold `length` values each.
    pub(super) fn stacks(length: u32) -> Self {
        Self { length: Some(length), by_type: BTreeMap::new() }
    }

    /// Returns a slot for a value of each of the types, in their order.
    pub(super) fn allocate(&mut self, linker: &mut Linker, types: &[u32]) -> Vec<u32> {
        let mut taken: HashMap<u32, usize> = HashMap::new();
        let mut slots = Vec::with_capacity(types.len());
        for ty in types {
            let place = taken.entry(*ty).or_default();
            let known = self.by_type.entry(*ty).or_default();
            if *place == known.len() {
                let held = self.length.map_or(*ty, |length| linker.array(*ty, length));
                known.push(linker.private(held));
            }
            slots.push(known[*place]);
            *place += 1;
        }
        slots
    }

    /// Returns the bytes of all values, or any number that [`check_stacks`](super::stack_size::check_stacks) refuses for more.
    pub(super) fn bytes(&self, linker: &Linker) -> u32 {
        let length = self.length.unwrap_or(1);
        let of_type = |(ty, slots): (&u32, &Vec<u32>)| {
            value_bytes(linker, *ty).saturating_mul(slots.len() as u32).saturating_mul(length)
        };
        self.by_type.iter().map(of_type).fold(0, u32::saturating_add)
    }

    /// Makes all values undefined.
    pub(super) fn forget(&self, emitter: &mut Emitter<'_>) {
        self.by_type.values().flatten().for_each(|slot| emitter.forget(*slot));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_share_slots_of_the_same_type() {
        let mut linker = Linker::new(0x0001_0600);
        let (uint, pair) = (linker.uint(), linker.uvec2());
        let mut slots = Slots::default();
        let first = slots.allocate(&mut linker, &[uint, pair, uint]);
        let second = slots.allocate(&mut linker, &[pair, uint]);
        assert_eq!(second, [first[1], first[0]]);
        assert_ne!(first[0], first[2]);
        assert_eq!(linker.variable_type(first[1]), Some(pair));
    }

    #[test]
    fn stacks_hold_arrays() {
        let mut linker = Linker::new(0x0001_0600);
        let uint = linker.uint();
        let stack = Slots::stacks(5).allocate(&mut linker, &[uint])[0];
        let array = linker.array(uint, 5);
        assert_eq!(linker.variable_type(stack), Some(array));
    }

    #[test]
    fn each_slot_of_a_stack_counts_at_each_depth() {
        let mut linker = Linker::new(0x0001_0600);
        let (uint, pair) = (linker.uint(), linker.uvec2());
        let mut stacks = Slots::stacks(5);
        stacks.allocate(&mut linker, &[uint, pair, uint]);
        assert_eq!(stacks.bytes(&linker), 5 * (4 + 8 + 4));
    }
}
