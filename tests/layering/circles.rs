//! Circles in a graph of who uses whom.

use std::collections::{BTreeMap, BTreeSet};

/// Who uses whom.
pub type Graph = BTreeMap<String, BTreeSet<String>>;

/// The groups of nodes that can all be reached from each other, each of two nodes or more, sorted. None: the graph has floors.
pub fn circles(graph: &Graph) -> Vec<Vec<String>> {
    let reached: BTreeMap<&str, BTreeSet<&str>> =
        graph.keys().map(|node| (node.as_str(), reach(graph, node))).collect();
    let mut found = BTreeSet::new();
    for (node, ahead) in &reached {
        let back = |other: &&&str| reached.get(**other).is_some_and(|ahead| ahead.contains(node));
        let mut group: BTreeSet<String> = ahead.iter().filter(back).map(|other| (*other).to_owned()).collect();
        group.insert((*node).to_owned());
        if group.len() > 1 {
            found.insert(group.into_iter().collect::<Vec<_>>());
        }
    }
    found.into_iter().collect()
}

/// All that can be reached from `start` in one step or more.
fn reach<'a>(graph: &'a Graph, start: &str) -> BTreeSet<&'a str> {
    let mut seen = BTreeSet::new();
    let mut open = vec![start];
    while let Some(node) = open.pop() {
        for next in graph.get(node).into_iter().flatten() {
            if seen.insert(next.as_str()) {
                open.push(next);
            }
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(edges: &[(&str, &str)]) -> Graph {
        let mut graph = Graph::new();
        for (from, to) in edges {
            graph.entry((*from).to_owned()).or_default().insert((*to).to_owned());
            graph.entry((*to).to_owned()).or_default();
        }
        graph
    }

    #[test]
    fn floors_have_no_circles() {
        assert!(circles(&graph(&[("a", "b"), ("a", "c"), ("b", "d"), ("c", "d")])).is_empty());
        assert!(circles(&graph(&[("a", "a")])).is_empty(), "a file may name itself");
        assert!(circles(&Graph::new()).is_empty());
    }

    #[test]
    fn circles_are_found_with_all_their_members_and_nobody_else() {
        let found =
            circles(&graph(&[("a", "b"), ("b", "c"), ("c", "a"), ("c", "d"), ("e", "a"), ("f", "g"), ("g", "f")]));
        assert_eq!(found, [vec!["a", "b", "c"], vec!["f", "g"]]);
        // Two circles through one node are one.
        assert_eq!(circles(&graph(&[("a", "b"), ("b", "a"), ("b", "c"), ("c", "b")])), [vec!["a", "b", "c"]]);
    }
}
