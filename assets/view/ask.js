// The search field: words of names, or a question with the grammar and meaning of `sqslam query`
// (slam/scene/query.h), whose answers stay while all other objects fade. data.questions has its words, the kinds of the
// scene graph's nodes (objects first), relations [kind, subject, other, probability], of each object [volume, bottom,
// top] and the distances of its surface to all nodes after it.

sq.relations = ["on", "in", "under", "above", "next to", "leans against"];
sq.superlatives = ["largest", "smallest", "tallest", "highest", "lowest", "nearest", "farthest"];
sq.nodeKinds = ["object", "surface", "floor", "wall"];
sq.unitsOfLength = {m: 1, metre: 1, metres: 1, meter: 1, meters: 1, cm: 0.01, mm: 0.001, unit: 0, units: 0};

// The word and what it may be the plural of.
sq.singulars = (word) => [word, ...[["s", ""], ["es", ""], ["ies", "y"], ["ves", "f"], ["ves", "fe"]]
  .filter(([ending]) => word.endsWith(ending)).map(([ending, instead]) => word.slice(0, -ending.length) + instead)];

sq.editDistance = (a, b) => {
  let row = [...Array(b.length + 1).keys()];
  for (let i = 0; i < a.length; ++i) {
    const next = [i + 1];
    for (let j = 0; j < b.length; ++j) next.push(Math.min(row[j + 1] + 1, next[j] + 1, row[j] + (a[i] === b[j] ? 0 : 1)));
    row = next;
  }
  return row[b.length];
};

// A known word that ends with this one or contains it, or the nearest one.
sq.nearestWord = (word, known) => {
  const longer = word.length < 3 ? undefined : known.find((other) => other.endsWith(word)) || known.find((other) => other.includes(word));
  if (longer) return longer;
  let [nearest, best] = ["", Math.max(2, word.length >> 1) + 1];
  for (const other of known) {
    const distance = Math.abs(other.length - word.length) < best ? sq.editDistance(word, other) : best;
    if (distance < best) [nearest, best] = [other, distance];
  }
  return nearest;
};

// Word -> the objects that it may mean, and the words of classes with legs.
sq.namesOf = (view) => {
  const named = new Map();
  const withLegs = new Set();
  const {classes} = view.data.questions;
  const add = (word, index) => {
    const key = word.toLowerCase().replaceAll(" ", "_");
    named.set(key, named.get(key) || new Set());
    if (index >= 0) named.get(key).add(index);
  };
  for (const [label, legs, synonyms] of classes) {
    for (const word of [label, ...synonyms]) {
      add(word, -1);
      if (legs) withLegs.add(word);
    }
  }
  view.data.objects.forEach(({label, name}, index) => {
    const known = classes.find(([other]) => other === label.replaceAll(" ", "_"));
    for (const word of [label, name, ...(known ? known[2] : [])]) add(word, index);
  });
  return {named, withLegs};
};

// Reads a sentence from left to right.
sq.parseQuestion = (view, text) => {
  const {terms, nodes} = view.data.questions;
  const {named, withLegs} = sq.namesOf(view);
  let words = (text.toLowerCase().match(/[a-z0-9._\u0080-\uffff]+|,/g) || []).filter(
    (word) => word !== "." && !(Object.hasOwn(terms, word) && terms[word][0] === "filler"));
  if (words.length > 0) words.push(words.pop().replace(/\.$/, ""));
  let at = 0;
  const ended = () => at >= words.length;
  const expect = (what) => {
    throw new Error("expected " + what + (ended() ? " at the end" : " before '" + words[at] + "'"));
  };
  const unknown = () => {
    const nearest = sq.nearestWord(words[at], [...[...named.keys()].sort(), ...Object.keys(terms)]);
    throw new Error("'" + words[at] + "' is not known" + (nearest ? "; did you mean '" + nearest + "'?" : ""));
  };
  // The longest phrase here of which find() knows a form.
  const longest = (joint, find) => {
    for (let length = Math.min(3, words.length - at); length > 0; --length) {
      for (const form of sq.singulars(words.slice(at, at + length).join(joint))) if (find(form)) return {form, length};
    }
    return null;
  };
  const termHere = () => {
    const found = longest(" ", (form) => Object.hasOwn(terms, form));
    return found && {role: terms[found.form][0], value: terms[found.form][1], length: found.length};
  };
  const take = (role) => {
    const term = termHere();
    if (!term || term.role !== role) return null;
    at += term.length;
    return term;
  };
  const takeWord = (word) => !ended() && words[at] === word && ++at > 0;
  const takeNumber = () => (!ended() && /^(\d+\.?\d*|\.\d+)$/.test(words[at]) ? Number(words[at++]) : null);
  const addNodes = (kind, members) => nodes.forEach((other, node) => other === kind && members.add(node));
  const readClass = (members) => {
    if (take("things")) return addNodes("object", members);
    const room = take("room");
    if (room) return addNodes(sq.nodeKinds[room.value], members);
    const found = longest("_", (form) => named.has(form));
    if (!found && (ended() || termHere())) expect("a class of objects, such as 'cups'");
    if (!found) unknown();
    at += found.length;
    const id = takeNumber();
    const those = named.get(found.form);
    for (const index of those) if (id === null || view.data.objects[index].id === id) members.add(index);
    if (those.size === 0 && withLegs.has(found.form)) addNodes("surface", members);
  };
  const joinsClasses = () => {  // "and" or a comma before a class, not before a further condition
    const before = at;
    while (take("join"));
    const term = termHere();
    if (at > before && !ended() && (!term || term.role === "things" || term.role === "room")) return true;
    at = before;
    return false;
  };
  const readThings = () => {
    const things = {members: new Set(), choice: null};
    let certain = null;
    for (;;) {
      const before = at;
      const count = takeNumber();
      const superlative = take("superlative");
      const certainty = superlative || count !== null ? null : take("certainty");
      if (superlative) things.choice = {by: superlative.value, count: count === null ? 1 : Math.trunc(count)};
      else if (certainty) certain = certainty.value === 1;
      else {
        at = before;
        break;
      }
    }
    do readClass(things.members);
    while (joinsClasses());
    const objects = view.data.objects;
    if (certain !== null) things.members = new Set([...things.members].filter((i) => i >= objects.length || objects[i].uncertain !== certain));
    return things;
  };
  const readLength = () => {
    const length = takeNumber();
    const joined = length === null && !ended() ? words[at].match(/^([\d.]+)([a-z]+)$/) : null;  // 30cm
    const value = joined ? Number(joined[1]) : length;
    const unit = joined ? joined[2] : words[at];
    if (joined || (length !== null && !ended())) ++at;
    if (value === null || Number.isNaN(value) || !Object.hasOwn(sq.unitsOfLength, unit) || !takeWord("of")) expect("a length, such as '0.5 m of',");
    const scale = sq.unitsOfLength[unit];
    if (scale > 0 && !(view.data.metres > 0)) throw new Error("the map has no scale, expected a length in 'units', or sqslam scale first");
    if (scale === 0 && view.data.metres > 0) throw new Error("the map is in metres, expected a length in m, cm or mm");
    return scale > 0 ? (value * scale) / view.data.metres : value;
  };
  const readFrame = () => {
    const frame = takeWord("seen") && takeWord("from") && (takeWord("frame"), takeNumber());
    return typeof frame === "number" ? frame : expect("'seen from' and the number of a frame");
  };
  const readCondition = () => {
    const negated = !!take("not");
    const term = ["relation", "within", "side", "superlative"].map(take).find((found) => found);
    if (!term && !ended() && !termHere()) unknown();
    if (!term) expect("a condition, such as 'on the table',");
    if (term.role === "superlative" && (term.value < 5 || !(takeWord("to") || takeWord("from")))) expect("'to' or 'from'");
    const length = term.role === "within" ? readLength() : 0;
    return {...term, negated, length, things: readThings(), frame: term.role === "side" ? readFrame() : 0};
  };
  const first = termHere();
  const things = {members: new Set(), choice: null};
  if (first && ["not", "relation", "within", "side"].includes(first.role)) addNodes("object", things.members);
  const question = {things: things.members.size > 0 ? things : readThings(), conditions: []};
  while (!ended()) if (!take("join")) question.conditions.push(readCondition());
  return question;
};

// The objects that answer a question, [{index, probability}], the best first. Throws an error with one line.
sq.answer = (view, text) => {
  const {questions, objects} = view.data;
  const {things, conditions} = sq.parseQuestion(view, text);
  const likely = new Map(questions.relations.map(([kind, a, b, probability]) => [kind + " " + a + " " + b, probability]));
  const probability = (kind, a, b) => likely.get(kind + " " + a + " " + b) || 0;
  const connected = (kind, a, b) => {
    if (kind === "above") return connected("under", b, a);
    const turned = {under: ["on", b, a], "next to": [kind, b, a]}[kind];
    return Math.max(probability(kind, a, b), turned ? probability(...turned) : 0);
  };
  const rank = (a, by) => {  // smaller comes first
    const [volume, bottom, top] = questions.extents[a];
    const ranks = {largest: -volume, smallest: volume, tallest: bottom - top, highest: -top, lowest: bottom};
    if (!(sq.superlatives[by] in ranks)) throw new Error("expected 'to' or 'from' and a class after 'nearest' and 'farthest'");
    return ranks[sq.superlatives[by]];
  };
  const keep = (list, count, rankOf) =>
    list.map((one) => [rankOf(one), one]).sort((a, b) => a[0] - b[0]).slice(0, Math.max(1, count)).map(([, one]) => one);
  const members = ({members: all, choice}) => {
    const list = [...all].sort((a, b) => a - b);
    return choice ? keep(list.filter((i) => i < objects.length), choice.count, (i) => rank(i, choice.by)) : list;
  };
  const between = (a, b) => (a < b ? questions.distances[a][b - a - 1] : questions.distances[b][a - b - 1]);
  const distance = (a, nodes) => Math.min(Infinity, ...nodes.filter((node) => node !== a).map((node) => between(a, node)));
  const atSide = (a, b, {value, frame}) => {  // as the keyframe nearest to the frame sees them
    if (b >= objects.length || view.data.keyframes.length === 0) return 0;
    const keyframe = view.data.keyframes.reduce((best, one) => (Math.abs(one.frame - frame) < Math.abs(best.frame - frame) ? one : best));
    const {position, rotation} = sq.poseAt(keyframe.pose);
    const [p, q] = [a, b].map((i) => sq.poseAt(objects[i].pose).position.sub(position).applyQuaternion(rotation.clone().inverse()));
    if (p.z <= 0 || q.z <= 0) return 0;
    const right = p.x / p.z - q.x / q.z;
    return [-right, right, q.z - p.z, p.z - q.z][value] > 0 ? 1 : 0;
  };
  const holds = (a, condition) => {
    const nodes = members(condition.things);
    if (condition.role === "within") return distance(a, nodes) <= condition.length ? 1 : 0;
    const one = (node) => (condition.role === "side" ? atSide(a, node, condition) : connected(sq.relations[condition.value], a, node));
    return Math.max(0, ...nodes.filter((node) => node !== a).map(one));
  };
  let answers = [];
  for (const index of objects.keys()) {
    let chance = things.members.has(index) ? 1 : 0;
    for (const condition of conditions) {
      if (condition.role === "superlative" || chance === 0) continue;
      chance *= condition.negated ? 1 - holds(index, condition) : holds(index, condition);
    }
    if (chance >= 0.5) answers.push({index, probability: chance});
  }
  for (const condition of conditions.filter(({role}) => role === "superlative")) {
    const sign = sq.superlatives[condition.value] === "nearest" ? 1 : -1;
    answers = keep(answers, 1, ({index}) => sign * distance(index, members(condition.things)));
  }
  if (things.choice) return keep(answers, things.choice.count, ({index}) => rank(index, things.choice.by));
  return answers.sort((a, b) => b.probability - a.probability);
};

// Searches for a text: the list keeps the rows with its words or, if there are none, the answers to it as a question.
sq.search = (view, text) => {
  const words = text.toLowerCase().split(/\s+/).filter((word) => word);
  const has = ({data: {name, label, id}}) =>
    words.every((word) => name.toLowerCase().includes(word) || label.toLowerCase().includes(word) || String(id) === word);
  let found = view.objects.filter(has);
  const line = view.root.querySelector(".sq-ask div");
  let [message, wrong] = ["", false];
  view.state.answers = null;
  if (found.length === 0 && words.length > 0) {
    try {
      found = sq.answer(view, text).map(({index}) => view.objects[index]);
      view.state.answers = new Set(found.map(({index}) => index));
      const names = found.slice(0, 3).map(({data}) => (data.name === data.label ? data.name + " " + data.id : data.name));
      if (found.length > 3) names.push(found.length - 3 + " more");
      const last = names.pop();
      message = last === undefined ? "no object of the map is an answer" : names.length > 0 ? names.join(", ") + " and " + last : last;
    } catch (error) {
      [message, wrong] = [error.message, true];
    }
  }
  line.textContent = message;
  line.classList.toggle("sq-wrong", wrong);
  for (const object of view.objects) object.row.hidden = !found.includes(object);
  view.root.querySelector(".sq-count").textContent =
    found.length === view.objects.length ? found.length : found.length + " of " + view.objects.length;
  sq.applyTime(view);
  view.tell("state");
  view.draw();
};

sq.buildSearch = (view) => {
  view.searchBox = view.root.querySelector(".sq-ask input");
  view.searchBox.addEventListener("input", () => sq.search(view, view.searchBox.value));
};
