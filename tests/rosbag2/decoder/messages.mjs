// The official definitions of ROS 2 Humble, and readers and writers of them.
import { ros2humble } from "@foxglove/rosmsg-msgs-common";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";

/// The definitions of a type and of all within it, the type itself first.
export function definitionsOf(type) {
  const names = [type];
  for (const name of names) {
    for (const field of official(name).definitions) {
      if (field.isComplex && !names.includes(field.type)) names.push(field.type);
    }
  }
  return names.map((name, i) => ({ ...official(name), name: i === 0 ? undefined : name }));
}

function official(type) {
  const found = ros2humble[type] ?? ros2humble[type.replace("/msg/", "/")];
  if (!found) throw new Error(`no official definition of ${type}`);
  return found;
}

const cached = (make) => {
  const made = new Map();
  return (type) => made.get(type) ?? made.set(type, make(type)).get(type);
};

export const readerOf = cached((type) => new MessageReader(definitionsOf(type)));
export const writerOf = cached((type) => new MessageWriter(definitionsOf(type)));
