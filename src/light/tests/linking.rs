//! Links: the rule against its statement, what names in directives come to, selection by them, and memory.

use super::*;
use crate::light::linking::labels::Labels;
use crate::light::linking::{Label, LinkRequests, LinkRule};
use crate::scene::{FileId, Param, ParamSet, ParamValue, Span, Warnings};

const SPAN: Span = Span { file: FileId(0), line: 1, column: 1, length: 1 };

/// A list of names as a parameter.
fn names(parameter: &str, names: &[&str]) -> Param {
    let value = ParamValue::String(names.iter().map(|name| (*name).to_owned()).collect());
    Param::new(parameter, "string", value, SPAN)
}

fn params(params: Vec<Param>) -> ParamSet {
    ParamSet::new("Shape \"sphere\"", SPAN, params)
}

/// The parameters of a light.
fn named(name: Option<&str>, is_exclusive: bool) -> ParamSet {
    let exclusive = Param::new("exclusive", "bool", ParamValue::Bool(vec![is_exclusive]), SPAN);
    params(name.map(|name| names("name", &[name])).into_iter().chain([exclusive]).collect())
}

fn table(lights: &[ParamSet], requests: &LinkRequests, strict: bool) -> (Option<Linking>, Vec<String>) {
    let mut warnings = Warnings::default();
    let mut labels = Labels::default();
    for (place, light) in lights.iter().enumerate() {
        let label = labels.read(light).expect("it is well typed");
        labels.set(place, label);
    }
    let linking = match labels.link(requests, strict, &mut warnings) {
        Ok(linking) => linking,
        Err(error) => return (None, vec![format!("error: {error}")]),
    };
    (linking, warnings.list().iter().map(|warning| warning.message.clone()).collect())
}

#[test]
fn a_set_is_what_its_parameters_say() {
    const NAMES: [&str; 3] = ["key", "rim", "sun"];
    // Every name with and without `exclusive`, and no name, twice.
    let lights: Vec<(Option<&str>, bool)> =
        NAMES.iter().map(Some).chain([None]).flat_map(|n| [(n.copied(), false), (n.copied(), true)]).collect();
    let lights = [&lights[..], &lights[..]].concat();
    let given: Vec<ParamSet> = lights.iter().map(|&(name, exclusive)| named(name, exclusive)).collect();
    let subset = |bits: usize| -> Vec<&str> { (0..3).filter(|i| bits >> i & 1 != 0).map(|i| NAMES[i]).collect() };
    let mut requests = LinkRequests::default();
    let mut sets = vec![];
    // 8 stands for a list that is not given.
    for (only, excluded, added) in (0..9).flat_map(|a| (0..8).flat_map(move |b| (0..8).map(move |c| (a, b, c)))) {
        let mut list = vec![names("excludelights", &subset(excluded)), names("addlights", &subset(added))];
        if only < 8 {
            list.push(names("lights", &subset(only)));
        }
        sets.push((requests.add(&params(list)).expect("it is well typed"), only, subset(excluded), subset(added)));
    }
    let (linking, warnings) = table(&given, &requests, true);
    assert_eq!(warnings, ["this light is exclusive and no object names it: it lights nothing"], "one has no name");
    let linking = linking.expect("there are links");
    assert_eq!(linking.set_count(), 9 * 8 * 8);
    for (set, only, excluded, added) in sets {
        let mut lit = vec![];
        for (i, &(name, is_exclusive)) in lights.iter().enumerate() {
            let is_in = |list: &[&str]| name.is_some_and(|name| list.contains(&name));
            let base = if only < 8 { is_in(&subset(only)) } else { !is_exclusive };
            let expected = (base || is_in(&added)) && !is_in(&excluded);
            let id = LightId(i as u32);
            assert_eq!(linking.is_linked(set, id), expected, "{set:?} {name:?} {is_exclusive}");
            assert_eq!(linking.is_exclusive(id), is_exclusive);
            if expected {
                lit.push(id);
            }
        }
        // The same by lists.
        let mut listed: Vec<LightId> = linking.named(set).collect();
        let ordinary = (0..lights.len()).filter(|&i| !lights[i].1).map(|i| LightId(i as u32));
        assert_eq!(linking.keeps_rest(set), only == 8);
        if linking.keeps_rest(set) {
            let excluded: Vec<LightId> = linking.excluded(set).collect();
            listed = ordinary.filter(|id| !excluded.contains(id)).chain(linking.extra(set)).collect();
        }
        listed.sort_unstable();
        assert_eq!(listed, lit, "{set:?}");
        let mut weights = vec![1.0; lights.len() + 2];
        linking.clear_unlinked(set, &mut weights);
        let kept: Vec<LightId> =
            (0..lights.len() as u32).map(LightId).filter(|id| weights[id.0 as usize] > 0.0).collect();
        assert_eq!(kept, lit);
        // Lights after the last that has a label are ordinary.
        assert_eq!(weights[lights.len()..], [f32::from(u8::from(only == 8)); 2]);
    }
}

#[test]
fn what_asks_for_the_same_shares_a_set() {
    let mut requests = LinkRequests::default();
    let mut add = |list: Vec<Param>| requests.add(&params(list)).expect("it is well typed");
    assert_eq!(add(vec![]), LinkSet::ORDINARY);
    assert_eq!(add(vec![names("excludelights", &[]), names("addlights", &[])]), LinkSet::ORDINARY);
    let dark = add(vec![names("lights", &[])]);
    let first = add(vec![names("lights", &["a", "b"])]);
    assert!(dark != LinkSet::ORDINARY && first != dark);
    assert_eq!(add(vec![names("lights", &["b", "a", "b"])]), first);
    assert_ne!(add(vec![names("addlights", &["a", "b"])]), first);
    let number = Param::new("lights", "float", ParamValue::Float(vec![1.0]), SPAN);
    assert!(requests.add(&params(vec![number])).is_err());
}

#[test]
fn names_that_no_light_has_are_reported() {
    let lights = [named(Some("key"), false), named(Some("lost"), true), named(None, true)];
    let mut requests = LinkRequests::default();
    for list in [&["kye", "key"][..], &["kye"]] {
        requests.add(&params(vec![names("lights", list)])).expect("it is well typed");
    }
    let (linking, warnings) = table(&lights, &requests, false);
    assert!(linking.expect("there are links").is_linked(LinkSet(1), LightId(0)));
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].contains("no light is called \"kye\"") && warnings[0].contains("did you mean key?"));
    assert!(warnings[1].contains("lights nothing (1 more"), "{warnings:?}");
    let (_, errors) = table(&lights, &requests, true);
    assert_eq!(errors, ["error: no light is called \"kye\""]);
    // Nothing is built where nothing asks for it.
    assert!(table(&lights[..1], &LinkRequests::default(), true).0.is_none());
}

#[test]
fn optimal_gives_unlinked_lights_no_weight() {
    let mut lights = Lights::default();
    for i in 0..6 {
        lights.add_point(PointLight { p: Vec3::new(i as f32, 2.0, 1.0), intensity: Rgb::splat(1.0 + i as f32) });
    }
    let labels = [1, 1, 2, 0, 2, 0].map(|name| Label::new(name, name == 2)).to_vec();
    let rules = [LinkRule::new([2], [1], true), LinkRule::new([1], [], false), LinkRule::new([], [], false)];
    let linked: [&[u32]; 4] = [&[0, 1, 3, 5], &[2, 3, 4, 5], &[0, 1], &[]];
    lights.set_linking(Some(Linking::new(labels, 3, rules)));
    let selector = LightSelector::build(SelectorKind::Optimal, &lights, &mut Warnings::default());
    let mut scratch = SelectorScratch::default();
    for (set, linked) in linked.into_iter().enumerate() {
        let receiver = Receiver::Surface { p: Vec3::ZERO, ns: Vec3::Y, two_sided: false, links: LinkSet(set as u32) };
        selector.prepare(&lights, &receiver, &mut scratch);
        let mut stream = Stream::from_seed(600 + set as u64);
        let mut counts = vec![0.0; lights.len()];
        for _ in 0..100_000 {
            let u = selector::choice(stream.next_f32(), stream.next_f32());
            let (id, pmf, _) = selector.sample(&lights, 0, u, &scratch).expect("there are lights");
            assert_eq!(pmf, selector.pmf(&lights, id, &scratch));
            counts[id.0 as usize] += 1.0;
        }
        let pmf: Vec<f64> = lights.ids().map(|id| f64::from(selector.pmf(&lights, id, &scratch))).collect();
        assert!((pmf.iter().sum::<f64>() - 1.0).abs() < 1e-6);
        let expected: Vec<f64> = pmf.iter().map(|p| p * 1e5).collect();
        chi_squared(&counts, &expected, &format!("set {set}"));
        for id in lights.ids() {
            assert_eq!(lights.is_linked(LinkSet(set as u32), id), linked.contains(&id.0));
            // What is left is the share of choices among all, which the integrator throws away.
            let is_rare = pmf[id.0 as usize] < 0.0017;
            assert_eq!(is_rare, !linked.is_empty() && !linked.contains(&id.0), "{set} {id:?}");
        }
    }
}

#[test]
fn millions_of_lights_in_many_sets_stay_small() {
    const LIGHTS: usize = 1_000_000;
    const SETS: u32 = 10_000;
    // A group of half the lights, one name for each other light: 1 + LIGHTS / 2 names.
    let labels: Vec<Label> =
        (0..LIGHTS as u32).map(|i| Label::new(if i % 2 == 0 { 1 } else { 2 + i / 2 }, i % 1000 == 1)).collect();
    let names = 2 + LIGHTS as u32 / 2;
    let rules = (0..SETS).map(|i| LinkRule::new([1], [2 + i, 3 + i], i % 2 == 0));
    let linking = Linking::new(labels, names, rules);
    assert!(linking.memory() <= 10 * LIGHTS + 48 * SETS as usize + 64, "{}", linking.memory());
    assert_eq!((linking.named_count(), linking.exclusive_count()), (LIGHTS, LIGHTS / 1000));
    let set = LinkSet(SETS);
    assert_eq!(linking.named(set).count(), LIGHTS / 2);
    let mut stream = Stream::from_seed(700);
    for _ in 0..1_000_000 {
        let set = LinkSet((stream.next_f32() * SETS as f32) as u32);
        let id = LightId((stream.next_f32() * LIGHTS as f32) as u32);
        let is_exclusive = id.0 % 1000 == 1;
        let is_excluded = id.0 % 2 == 1 && [set.0, set.0 + 1].contains(&(id.0 / 2 + 1));
        let keeps_rest = set == LinkSet::ORDINARY || set.0 % 2 == 1;
        let in_group = set != LinkSet::ORDINARY && id.0.is_multiple_of(2);
        let expected = !(set != LinkSet::ORDINARY && is_excluded) && (in_group || keeps_rest && !is_exclusive);
        assert_eq!(linking.is_linked(set, id), expected, "{set:?} {id:?}");
    }
}
