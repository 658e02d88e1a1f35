//! What stays in RAM and in the pool: two hard budgets, and who must leave when one is full.
//!
//! Tiles that the plan wants never leave, and the cut is chosen so that they fit. Of the others those leave first that
//! were looked at longest ago, finer ones before coarser ones, so that a tile's ancestors outlast it.

use super::{ColorPool, Life, NO_NODE, Tree};

/// Slots of the pool.
#[derive(Debug)]
pub struct SlotPool {
    free: Vec<u32>,
    capacity: u32,
}

impl SlotPool {
    /// A pool of empty slots.
    #[must_use]
    pub fn new(capacity: u32) -> Self {
        Self {
            free: (0..capacity).rev().collect(),
            capacity,
        }
    }

    /// Slots in all.
    #[must_use]
    pub fn capacity(&self) -> u32 {
        self.capacity
    }

    /// Slots in use.
    #[must_use]
    pub fn used(&self) -> u32 {
        self.capacity - u32::try_from(self.free.len()).unwrap_or(0)
    }
}

/// The two budgets and those who may have to leave.
#[derive(Debug)]
pub(crate) struct Residency {
    pub(crate) slots: SlotPool,
    /// Bytes of tiles in RAM.
    pub(crate) ram_bytes: u64,
    pub(crate) ram_budget: u64,
    /// Who leaves RAM, who leaves the pool; last in the list first. Empty until someone must.
    ram_victims: Option<Vec<u32>>,
    slot_victims: Option<Vec<u32>>,
}

impl Residency {
    pub(crate) fn new(slots: u32, ram_budget: u64) -> Self {
        let slots = SlotPool::new(slots);
        Self {
            slots,
            ram_bytes: 0,
            ram_budget,
            ram_victims: None,
            slot_victims: None,
        }
    }

    /// Stamps have changed: look for victims anew.
    pub(crate) fn forget_victims(&mut self) {
        (self.ram_victims, self.slot_victims) = (None, None);
    }

    /// Makes room for `bytes` beside what is there; false when all that is there is wanted, or was looked at in plan
    /// `since` or later.
    pub(crate) fn make_room(
        &mut self,
        tree: &mut Tree,
        colors: &mut ColorPool,
        bytes: u64,
        plan: u64,
        since: u64,
    ) -> bool {
        while self.ram_bytes + bytes > self.ram_budget {
            let victims = self
                .ram_victims
                .get_or_insert_with(|| victims(tree, plan, |_| true));
            match victims.last() {
                Some(&victim) if tree.node(victim).used < since => victims.pop(),
                _ => return false,
            }
            .into_iter()
            .for_each(|victim| self.evict(tree, colors, victim));
        }
        true
    }

    /// The pool is empty.
    pub(crate) fn empty_slots(&mut self, tree: &mut Tree) {
        for place in 0..tree.places() {
            let node = tree.node_mut(place);
            if let Life::Uploaded { tile, .. } = &node.life {
                node.life = Life::Resident(tile.clone());
            }
        }
        self.slots = SlotPool::new(self.slots.capacity());
        self.forget_victims();
    }

    fn evict(&mut self, tree: &mut Tree, colors: &mut ColorPool, victim: u32) {
        if tree.node(victim).tile().is_none() {
            return;
        }
        let bytes = tree.node(victim).byte_count();
        let slot = tree.node(victim).slot();
        for child in tree
            .node(victim)
            .children
            .into_iter()
            .filter(|&child| child != NO_NODE)
        {
            if tree.node(child).tile().is_none() {
                colors.release(tree, child);
            }
        }
        if !tree.evict(victim) {
            return;
        }
        self.ram_bytes -= bytes;
        self.slots.free.extend(slot);
        colors.release(tree, victim);
    }

    /// A free slot, or one that held what the plan does not want.
    pub(crate) fn slot(&mut self, tree: &mut Tree, plan: u64) -> Option<u32> {
        if let Some(slot) = self.slots.free.pop() {
            return Some(slot);
        }
        let victims = self.slot_victims.get_or_insert_with(|| {
            victims(tree, plan, |life| matches!(life, Life::Uploaded { .. }))
        });
        while let Some(victim) = victims.pop() {
            let node = tree.node_mut(victim);
            if let Life::Uploaded { tile, slot } = &node.life {
                let slot = *slot;
                node.life = Life::Resident(tile.clone());
                return Some(slot);
            }
        }
        None
    }
}

fn victims(tree: &Tree, plan: u64, is_in: impl Fn(&Life) -> bool) -> Vec<u32> {
    let idle = |&place: &u32| {
        let node = tree.node(place);
        place != Tree::ROOT
            && node.wanted != plan
            && node.tile().is_some()
            && is_in(&node.life)
            && tree.is_live(place)
    };
    let mut victims: Vec<_> = (0..tree.places()).filter(idle).collect();
    victims.sort_unstable_by_key(|&place| {
        let node = tree.node(place);
        (std::cmp::Reverse(node.used), node.id)
    });
    victims
}
