//! Recently used tiles within a limit in bytes: the clock algorithm, in shards that are locked separately.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::texture::texel::ResidentTexels;

/// Cache of tiles by their offset in the file.
#[derive(Debug)]
pub(crate) struct TileCache {
    shards: Vec<Mutex<Shard>>,
    /// Limit in bytes of each shard.
    limit: u64,
}

#[derive(Debug, Default)]
struct Shard {
    slots: Vec<CachedTile>,
    /// Index of each tile in `slots`.
    index: HashMap<u64, usize>,
    clock_hand: usize,
    bytes: u64,
}

#[derive(Debug)]
struct CachedTile {
    start: u64,
    tile: Arc<ResidentTexels>,
    bytes: u64,
    /// True if used since the clock hand last passed.
    used: bool,
}

/// Bookkeeping per tile in addition to its texels, in bytes.
const TILE_OVERHEAD_BYTES: u64 = 160;

impl TileCache {
    /// Creates a cache of at most `limit` bytes.
    pub fn new(limit: u64) -> Self {
        // Each shard has room for at least about sixteen tiles of the largest size.
        let parts = (limit >> 20).clamp(1, 64);
        Self { shards: (0..parts).map(|_| Mutex::default()).collect(), limit: limit / parts }
    }

    /// The tile at this offset, if the tile is in memory.
    pub fn get(&self, start: u64) -> Option<Arc<ResidentTexels>> {
        let mut part = self.shard(start).lock().unwrap_or_else(PoisonError::into_inner);
        let index = *part.index.get(&start)?;
        let slot = &mut part.slots[index];
        slot.used = true;
        Some(slot.tile.clone())
    }

    /// Inserts a tile of `bytes` bytes; evicts tiles that have not been used since the clock hand last passed.
    pub fn insert(&self, start: u64, tile: Arc<ResidentTexels>, bytes: u64) {
        let bytes = bytes + TILE_OVERHEAD_BYTES;
        let mut part = self.shard(start).lock().unwrap_or_else(PoisonError::into_inner);
        // Another thread may have read and inserted the tile at the same time.
        if part.index.contains_key(&start) || bytes > self.limit {
            return;
        }
        while part.bytes + bytes > self.limit {
            part.evict_one();
        }
        part.bytes += bytes;
        let index = part.slots.len();
        part.index.insert(start, index);
        part.slots.push(CachedTile { start, tile, bytes, used: false });
    }

    fn shard(&self, start: u64) -> &Mutex<Shard> {
        let mixed = start.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
        &self.shards[mixed as usize % self.shards.len()]
    }
}

impl Shard {
    /// Evicts the next tile that has not been used during a full turn of the clock hand. There is always at least one
    /// such tile.
    fn evict_one(&mut self) {
        loop {
            if self.clock_hand >= self.slots.len() {
                self.clock_hand = 0;
            }
            if !std::mem::take(&mut self.slots[self.clock_hand].used) {
                break;
            }
            self.clock_hand += 1;
        }
        let dropped = self.slots.swap_remove(self.clock_hand);
        self.index.remove(&dropped.start);
        self.bytes -= dropped.bytes;
        if let Some(moved) = self.slots.get(self.clock_hand) {
            self.index.insert(moved.start, self.clock_hand);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tile(value: u8) -> Arc<ResidentTexels> {
        Arc::new(ResidentTexels::Linear8(vec![[value; 4]]))
    }

    #[test]
    fn cache_keeps_recent_tiles_within_its_limit() {
        let cache = TileCache::new(10 * (1000 + TILE_OVERHEAD_BYTES));
        for i in 0..100u8 {
            cache.insert(u64::from(i), tile(i), 1000);
            assert_eq!(cache.get(0), Some(tile(0)), "after {i}");
            let part = cache.shards[0].lock().unwrap();
            assert_eq!(part.slots.len(), part.index.len());
            assert_eq!(part.slots.len(), (usize::from(i) + 1).min(10));
            assert_eq!(part.bytes, part.slots.len() as u64 * (1000 + TILE_OVERHEAD_BYTES));
        }
        let kept: Vec<u8> = (0..100).filter(|&i| cache.get(i.into()).is_some()).collect();
        assert_eq!(kept.len(), 10);
        for i in kept {
            assert_eq!(cache.get(i.into()), Some(tile(i)));
        }
    }

    #[test]
    fn cache_does_not_keep_tiles_above_its_limit() {
        let cache = TileCache::new(500);
        cache.insert(7, tile(7), 1000);
        assert_eq!(cache.get(7), None);
    }

    #[test]
    fn large_caches_are_split_into_even_shards() {
        let cache = TileCache::new(64 << 20);
        assert_eq!(cache.shards.len(), 64);
        for i in 0..64 * 100 {
            cache.insert(i * 16384, tile(0), 1000);
        }
        for part in &cache.shards {
            let count = part.lock().unwrap().slots.len();
            assert!((50..200).contains(&count), "{count}");
        }
    }
}
