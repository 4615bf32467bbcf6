// Lists of the trees that a volume sees, and the draw calls for them, by prefix sums: no atomics, so the order is that of
// the CPU's lists (src/cull/select.rs). Four steps, one dispatch each: see src/render/cull/mod.rs.
#import canopy::constants::{MAX_LEVELS, CLUSTER_BITS, VARIANT_LOW_SHIFT, VARIANT_LOW_BITS, VARIANT_HIGH_SHIFT, VARIANT_HIGH_BITS}
#import canopy::constants::{LIST_HEADER, LIST_STARTS, LIST_TOTALS, SORT_THREADS, TEST_THREADS}
#import canopy::instance::Tree
#import canopy::volume::{volume, Cluster, TreeSize, look_at, levels_of_tree}

// A draw call: the trees of one group, each with so many vertices.
struct TreeDraw {
    group: u32,
    vertices: u32,
    // 1: indices, and trees are instances; 2: vertices, and trees are instances; 0: neither.
    kind: u32,
    // The first vertex of kind 2.
    first_vertex: u32,
    // Which share of the group, and how many shares there are.
    share: u32,
    shares: u32,
}

// Sizes of the buffers, in words.
struct ListRoom {
    // Entries of the list.
    capacity: u32,
    // Entries that can be sorted by variant, after the words of the clusters in `work`.
    staging: u32,
    // Number of groups of all levels.
    group_count: u32,
    // Number of draw calls.
    draw_count: u32,
}

@group(0) @binding(1) var<storage, read> trees: array<Tree>;
@group(0) @binding(2) var<storage, read> clusters: array<Cluster>;
@group(0) @binding(3) var<storage, read> sizes: array<TreeSize>;
@group(0) @binding(4) var<storage, read> draws: array<TreeDraw>;
// Clusters with their keys, twice; then the number of trees of each cluster and level, later where their list begins;
// then room to sort trees by variant.
@group(0) @binding(5) var<storage, read_write> work: array<u32>;
// Indices of trees, level by level, group by group.
@group(0) @binding(6) var<storage, read_write> list: array<u32>;
// A header, the ranges of the groups in `list`, and the arguments of the draw calls, five words each.
@group(0) @binding(7) var<storage, read_write> results: array<u32>;
@group(0) @binding(8) var<uniform> room: ListRoom;

// A cluster that is not seen.
const HIDDEN: u32 = 0xffffffffu;
const CLUSTER_MASK: u32 = (1u << CLUSTER_BITS) - 1u;
// Words of the header: seen clusters, trees of all levels, trees of the largest level that is sorted by variant.
const SEEN: u32 = 0u;
const WANTED: u32 = 1u;
const WANTED_STAGING: u32 = 2u;

fn variant_of(tree: Tree) -> u32 {
    let low = extractBits(tree.look, VARIANT_LOW_SHIFT, VARIANT_LOW_BITS);
    return low | (extractBits(tree.cell, VARIANT_HIGH_SHIFT, VARIANT_HIGH_BITS) << VARIANT_LOW_BITS);
}

fn levels_of(index: u32) -> u32 {
    let tree = trees[index];
    let variant = variant_of(tree);
    if variant >= volume.variant_count {
        return 0u;
    }
    return levels_of_tree(tree, sizes[variant]);
}

// First word of the counts of `cluster`.
fn counts_of(cluster: u32) -> u32 {
    return 2u * volume.cluster_count + cluster * volume.level_count;
}

// Step 1: which clusters are seen, with which key, and how many trees they have in each level.
@compute @workgroup_size(TEST_THREADS)
fn test_clusters(@builtin(global_invocation_id) id: vec3<u32>) {
    let index = id.x;
    if index >= volume.cluster_count {
        return;
    }
    let cluster = clusters[index];
    let look = look_at(cluster);
    if look.seen == 0u {
        work[index] = HIDDEN;
        return;
    }
    var counts: array<u32, MAX_LEVELS>;
    if look.whole > 0u {
        counts[look.whole - 1u] = cluster.count;
    } else {
        for (var i = 0u; i < cluster.count; i++) {
            let levels = levels_of(cluster.first + i);
            for (var level = 0u; level < volume.level_count; level++) {
                counts[level] += (levels >> level) & 1u;
            }
        }
    }
    let first = counts_of(index);
    for (var level = 0u; level < volume.level_count; level++) {
        work[first + level] = counts[level];
    }
    work[index] = (look.key << CLUSTER_BITS) | index;
}

const SORT_DIGITS: u32 = 16u;
// Counters of the digits, those of digit 0 of all threads first.
var<workgroup> counters: array<u32, SORT_DIGITS * SORT_THREADS>;
var<workgroup> sums: array<u32, SORT_THREADS>;
// Trees of a level that are sorted by variant.
var<workgroup> sorted_count: u32;

// Sum of `value` over the threads before this one [Hillis and Steele 1986].
fn sum_before(thread: u32, value: u32) -> u32 {
    workgroupBarrier();
    sums[thread] = value;
    workgroupBarrier();
    for (var step = 1u; step < SORT_THREADS; step *= 2u) {
        var sum = sums[thread];
        if thread >= step {
            sum += sums[thread - step];
        }
        workgroupBarrier();
        sums[thread] = sum;
        workgroupBarrier();
    }
    return sums[thread] - value;
}

// Replaces the counters by where the items of each digit and thread begin.
fn scan_counters(thread: u32) {
    workgroupBarrier();
    let first = thread * SORT_DIGITS;
    var sum = 0u;
    for (var i = 0u; i < SORT_DIGITS; i++) {
        sum += counters[first + i];
    }
    var before = sum_before(thread, sum);
    for (var i = 0u; i < SORT_DIGITS; i++) {
        let count = counters[first + i];
        counters[first + i] = before;
        before += count;
    }
    workgroupBarrier();
}

// Sorts `count` words of `work` from `source` to `destination` by four bits from `shift` on; equal ones keep their order,
// and hidden ones are left out. Returns how many there are.
fn sort_clusters_by(thread: u32, source: u32, destination: u32, count: u32, shift: u32) {
    let run = (count + SORT_THREADS - 1u) / SORT_THREADS;
    let first = min(thread * run, count);
    let end = min(first + run, count);
    for (var digit = 0u; digit < SORT_DIGITS; digit++) {
        counters[digit * SORT_THREADS + thread] = 0u;
    }
    for (var i = first; i < end; i++) {
        let item = work[source + i];
        if item != HIDDEN {
            counters[((item >> shift) & 15u) * SORT_THREADS + thread] += 1u;
        }
    }
    scan_counters(thread);
    for (var i = first; i < end; i++) {
        let item = work[source + i];
        if item != HIDDEN {
            let counter = ((item >> shift) & 15u) * SORT_THREADS + thread;
            work[destination + counters[counter]] = item;
            counters[counter] += 1u;
        }
    }
    storageBarrier();
    workgroupBarrier();
}

// Step 2: sorts the seen clusters by their keys, and sums their trees.
@compute @workgroup_size(SORT_THREADS)
fn sort_clusters(@builtin(local_invocation_id) id: vec3<u32>) {
    let thread = id.x;
    let all = volume.cluster_count;
    sort_clusters_by(thread, 0u, all, all, CLUSTER_BITS);
    // The last counter has become the number of items.
    let seen = counters[SORT_DIGITS * SORT_THREADS - 1u];
    workgroupBarrier();
    sort_clusters_by(thread, all, 0u, seen, CLUSTER_BITS + 4u);
    sort_clusters_by(thread, 0u, all, seen, CLUSTER_BITS + 8u);

    let run = (seen + SORT_THREADS - 1u) / SORT_THREADS;
    let first = min(thread * run, seen);
    let end = min(first + run, seen);
    var next: array<u32, MAX_LEVELS>;
    for (var i = first; i < end; i++) {
        let counts = counts_of(work[all + i] & CLUSTER_MASK);
        for (var level = 0u; level < volume.level_count; level++) {
            next[level] += work[counts + level];
        }
    }
    var start = 0u;
    var most_sorted = 0u;
    for (var level = 0u; level < MAX_LEVELS; level++) {
        let own = next[level];
        let before = sum_before(thread, own);
        let total = sums[SORT_THREADS - 1u];
        next[level] = start + before;
        if thread == 0u {
            results[LIST_STARTS + level] = start;
            results[LIST_TOTALS + level] = total;
        }
        start += total;
        most_sorted = max(most_sorted, total * volume.levels[level].by_variant);
    }
    if thread == 0u {
        results[SEEN] = seen;
        results[WANTED] = start;
        results[WANTED_STAGING] = select(0u, most_sorted, volume.variant_count > 1u);
    }
    for (var i = first; i < end; i++) {
        let counts = counts_of(work[all + i] & CLUSTER_MASK);
        for (var level = 0u; level < volume.level_count; level++) {
            let count = work[counts + level];
            work[counts + level] = next[level];
            next[level] += count;
        }
    }
}

fn put(position: u32, tree: u32) {
    if position < room.capacity {
        list[position] = tree;
    }
}

// Step 3: writes the trees of each seen cluster to where they belong.
@compute @workgroup_size(TEST_THREADS)
fn write_trees(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= results[SEEN] {
        return;
    }
    let index = work[volume.cluster_count + id.x] & CLUSTER_MASK;
    let cluster = clusters[index];
    let look = look_at(cluster);
    let counts = counts_of(index);
    if look.whole > 0u {
        let start = work[counts + look.whole - 1u];
        for (var i = 0u; i < cluster.count; i++) {
            put(start + i, cluster.first + i);
        }
        return;
    }
    var next: array<u32, MAX_LEVELS>;
    for (var level = 0u; level < volume.level_count; level++) {
        next[level] = work[counts + level];
    }
    for (var i = 0u; i < cluster.count; i++) {
        let levels = levels_of(cluster.first + i);
        for (var level = 0u; level < volume.level_count; level++) {
            if ((levels >> level) & 1u) == 1u {
                put(next[level], cluster.first + i);
                next[level] += 1u;
            }
        }
    }
}

// Entries of `level` that the list holds.
fn drawn_count(level: u32) -> u32 {
    let start = results[LIST_STARTS + level];
    let total = min(results[LIST_TOTALS + level], room.capacity - min(start, room.capacity));
    let is_sorted = volume.levels[level].by_variant == 1u && volume.variant_count > 1u;
    return select(total, min(total, room.staging), is_sorted);
}

// Sorts `count` entries by four bits of their variant from `shift` on, from the list to the staging area or back.
fn sort_trees_by(thread: u32, start: u32, count: u32, shift: u32, to_staging: bool) {
    let staging = counts_of(volume.cluster_count);
    let run = (count + SORT_THREADS - 1u) / SORT_THREADS;
    let first = min(thread * run, count);
    let end = min(first + run, count);
    for (var digit = 0u; digit < SORT_DIGITS; digit++) {
        counters[digit * SORT_THREADS + thread] = 0u;
    }
    for (var i = first; i < end; i++) {
        var tree = 0u;
        if to_staging {
            tree = list[start + i];
        } else {
            tree = work[staging + i];
        }
        counters[((variant_of(trees[tree]) >> shift) & 15u) * SORT_THREADS + thread] += 1u;
    }
    scan_counters(thread);
    for (var i = first; i < end; i++) {
        var tree = 0u;
        if to_staging {
            tree = list[start + i];
        } else {
            tree = work[staging + i];
        }
        let counter = ((variant_of(trees[tree]) >> shift) & 15u) * SORT_THREADS + thread;
        let position = counters[counter];
        counters[counter] += 1u;
        if to_staging {
            work[staging + position] = tree;
        } else {
            list[start + position] = tree;
        }
    }
    storageBarrier();
    workgroupBarrier();
}

// The first of `count` entries from `start` on whose variant is at least `variant`.
fn first_of_variant(start: u32, count: u32, variant: u32) -> u32 {
    var low = start;
    var high = start + count;
    while low < high {
        let middle = (low + high) / 2u;
        if variant_of(trees[list[middle]]) < variant {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low;
}

// Step 4: sorts the levels that are grouped by variant, and writes the groups' ranges and the draw calls.
@compute @workgroup_size(SORT_THREADS)
fn group_trees(@builtin(local_invocation_id) id: vec3<u32>) {
    let thread = id.x;
    for (var level = 0u; level < MAX_LEVELS; level++) {
        let exists = level < volume.level_count;
        let is_sorted = exists && volume.levels[level].by_variant == 1u;
        let start = results[LIST_STARTS + level];
        let count = select(0u, drawn_count(level), exists);
        let sorted = select(0u, count, is_sorted && volume.variant_count > 1u);
        if thread == 0u {
            sorted_count = sorted;
        }
        // The same for all threads, so that they meet at the barriers.
        if workgroupUniformLoad(&sorted_count) > 0u {
            // Variants have ten bits: four passes, so that the trees are in the list again.
            sort_trees_by(thread, start, sorted, 0u, true);
            sort_trees_by(thread, start, sorted, 4u, false);
            sort_trees_by(thread, start, sorted, 8u, true);
            sort_trees_by(thread, start, sorted, 12u, false);
        }
        let groups = select(select(0u, 1u, exists), volume.variant_count, is_sorted);
        let ranges = LIST_HEADER + 2u * volume.levels[level].first_group;
        for (var group = thread; group < groups; group += SORT_THREADS) {
            var first = start;
            var end = start + count;
            if is_sorted {
                first = first_of_variant(start, count, group);
                end = first_of_variant(start, count, group + 1u);
            }
            results[ranges + 2u * group] = first;
            results[ranges + 2u * group + 1u] = end;
        }
    }
    storageBarrier();
    workgroupBarrier();
    let arguments = LIST_HEADER + 2u * room.group_count;
    for (var index = thread; index < room.draw_count; index += SORT_THREADS) {
        let call = draws[index];
        let group_first = results[LIST_HEADER + 2u * call.group];
        let group_count = results[LIST_HEADER + 2u * call.group + 1u] - group_first;
        // As `Share::cut` of src/cull/lists.rs.
        let first = group_first + group_count * call.share / call.shares;
        let count = group_first + group_count * (call.share + 1u) / call.shares - first;
        let slot = arguments + 5u * index;
        let indexed = call.kind == 1u;
        let instanced = call.kind != 0u;
        // Indices, instances, first index, base vertex, first instance; or vertices, instances, first vertex, first
        // instance. Without instances each pulled vertex finds its tree by its index.
        results[slot] = select(count * call.vertices, call.vertices, instanced);
        results[slot + 1u] = select(1u, count, instanced);
        results[slot + 2u] = select(first * call.vertices, call.first_vertex, instanced);
        results[slot + 3u] = select(0u, first, call.kind == 2u);
        results[slot + 4u] = select(0u, first, indexed);
    }
}
