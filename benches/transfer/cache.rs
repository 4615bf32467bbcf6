//! From the cache's file to arrays.

use std::sync::Arc;
use std::time::Instant;

use canopy::bake::cache::{Cache, CacheKey};
use canopy::bake::{BakeSettings, BakeSource, bake_plant};
use canopy::plant::Plant;

/// The table of the cache: hashing of the source included, the file in the page cache.
pub fn cache(plant: &Arc<Plant>, turns: usize) {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::new(folder.path());
    let settings = BakeSettings::default();
    let start = Instant::now();
    bake_plant(Arc::clone(plant), &settings, Some(&cache));
    let cold = start.elapsed().as_secs_f64();
    let key = CacheKey::new(plant, &settings.sanitized());
    let bytes = std::fs::metadata(cache.file(&key)).expect("a file").len();
    let (mut whole, mut hashing) = (Vec::new(), Vec::new());
    for _ in 0..turns.max(1) * 5 {
        let start = Instant::now();
        let (_, source) = bake_plant(Arc::clone(plant), &settings, Some(&cache));
        whole.push(start.elapsed().as_secs_f64() * 1e3);
        assert!(matches!(source, BakeSource::Cache), "the file is good");
        let start = Instant::now();
        std::hint::black_box(CacheKey::new(plant, &settings));
        hashing.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let [whole, hashing] = [whole, hashing].map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!("## Cache\n\n| | |\n|---|--:|\n| cold, cross and shadow proxy included | {cold:.2} s |");
    println!("| file | {:.2} MB |", bytes as f64 / 1e6);
    println!("| file to arrays, hashing of the source included | {whole:.1} ms |");
    println!("| of that, hashing | {hashing:.1} ms |\n");
}
