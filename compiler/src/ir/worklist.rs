//! Functions that are named before they are made.

use super::hash::HashMap;
use super::{FunctionId, Module};
use std::hash::Hash;

/// The functions that a transformation needs, such as derivatives, by what they are: each is made once, after those
/// that call it were begun.
#[derive(Debug)]
pub(crate) struct Worklist<K> {
    ids: HashMap<K, FunctionId>,
    /// The functions that are still to be made.
    left: Vec<(K, FunctionId)>,
}

impl<K> Default for Worklist<K> {
    fn default() -> Worklist<K> {
        Worklist { ids: HashMap::default(), left: Vec::new() }
    }
}

impl<K: Clone + Eq + Hash> Worklist<K> {
    /// The id of a function, which is reserved in the module and put on the list if it is new.
    pub(crate) fn id(&mut self, module: &mut Module, key: K) -> FunctionId {
        if let Some(id) = self.ids.get(&key) {
            return *id;
        }
        let id = module.reserve();
        self.ids.insert(key.clone(), id);
        self.left.push((key, id));
        id
    }

    /// Takes a function that is to be made from the list.
    pub(crate) fn next(&mut self) -> Option<(K, FunctionId)> {
        self.left.pop()
    }
}
