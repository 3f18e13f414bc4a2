"""Reads a LeRobot data set (v2.0, v2.1, v3.0) and writes records (framing.py).

usage: read_lerobot.py FOLDER list
       read_lerobot.py FOLDER read JSON

`list` writes one record "dataset": version, episodes (how many there should be), present (which have their files of
readings), columns (names of the readings), cameras (keys of pictures). `read` writes the episodes that JSON names:
{"episodes": [NUMBER...], "cameras": [KEY...]}. Of each: "episode" with its readings (payload: a stamp in s for each
row, then the rows), its pictures as "frame" (RGB) or "compressed" (a file), in order of time, and "episode_end"; or
"absent" and why.
"""
import heapq
import json
import math
import pathlib
import sys

import framing

STATE = "observation.state"
MOST_VALUES = 30_000_000  # of one episode: 240 MB


class DataSet:
    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        file = self.folder / "meta" / "info.json"
        if not file.is_file():
            raise ValueError("no meta/info.json; expected the folder of a LeRobot data set")
        with open(file, encoding="utf-8") as stream:
            self.info = json.load(stream)
        self.version = str(self.info.get("codebase_version", "")).lstrip("v")
        if self.version.split(".")[0] not in ("2", "3"):
            raise ValueError(f"meta/info.json: codebase_version is '{self.version}'; expected v2.0, v2.1 or v3.0")
        self.v3 = self.version.startswith("3")
        self.fps = float(self.info["fps"])
        self.features = self.info["features"]
        self.cameras = {key: feature for key, feature in self.features.items()
                        if feature.get("dtype") in ("video", "image")}
        self.states = [key for key, feature in self.features.items()
                       if (key == STATE or key.startswith(STATE + ".")) and key not in self.cameras]
        self.episodes = self.read_episodes() if self.v3 else {}
        total = int(self.info.get("total_episodes", 0))
        self.total = max(total, 1 + max(self.episodes)) if self.episodes else total

    def read_episodes(self):
        """Of v3: where each episode is, by its number."""
        from pyarrow import parquet  # pylint: disable=import-outside-toplevel
        rows = {}
        for file in sorted((self.folder / "meta" / "episodes").glob("*/*.parquet")):
            wanted = [name for name in parquet.read_schema(file).names
                      if name in ("episode_index", "length") or name.startswith(("data/", "videos/"))]
            for row in parquet.read_table(file, columns=wanted).to_pylist():
                rows[int(row["episode_index"])] = row
        if not rows:
            raise ValueError("no meta/episodes/*/*.parquet, which say where an episode of v3.0 is")
        return rows

    def file(self, template, **values):
        path = pathlib.PurePosixPath(str(self.info[template]).format(**values))
        if path.is_absolute() or ".." in path.parts:
            raise ValueError(f"meta/info.json: {template} leads out of the data set")
        return self.folder / path

    def rows_file(self, episode):
        if self.v3:
            row = self.episodes[episode]
            return self.file("data_path", chunk_index=int(row["data/chunk_index"]),
                             file_index=int(row["data/file_index"]))
        return self.file("data_path", episode_chunk=episode // int(self.info.get("chunks_size", 1000)),
                         episode_index=episode)

    def video(self, episode, key):
        """The file and the part of it, s."""
        if self.v3:
            row = self.episodes[episode]
            file = self.file("video_path", video_key=key, chunk_index=int(row[f"videos/{key}/chunk_index"]),
                             file_index=int(row[f"videos/{key}/file_index"]))
            return file, float(row[f"videos/{key}/from_timestamp"]), float(row[f"videos/{key}/to_timestamp"])
        return self.file("video_path", video_key=key, episode_index=episode,
                         episode_chunk=episode // int(self.info.get("chunks_size", 1000))), 0.0, math.inf

    def present(self):
        candidates = sorted(self.episodes) if self.v3 else range(self.total)
        return [episode for episode in candidates if self.rows_file(episode).is_file()]

    def columns(self):
        """(key, position, name) of every reading."""
        all_columns = []
        for key in self.states:
            count = int(self.features[key]["shape"][0])
            names = flat(self.features[key].get("names"))
            if len(names) != count:
                names = [f"{key}[{i}]" for i in range(count)]
            all_columns += [(key, i, name) for i, name in enumerate(names)]
        names = [name for _, _, name in all_columns]
        return [(key, i, name if names.count(name) == 1 else f"{key}[{i}]") for key, i, name in all_columns]


def flat(names):
    """Names as data sets have them: a list, lists within it, or by groups."""
    if isinstance(names, str):
        return [names]
    if isinstance(names, dict):
        names = list(names.values())
    return [name for entry in names or [] for name in flat(entry)]


def read_rows(dataset, episode):
    """Stamps and rows of readings, rows x columns."""
    import numpy  # pylint: disable=import-outside-toplevel
    from pyarrow import parquet  # pylint: disable=import-outside-toplevel
    filters = [("episode_index", "=", episode)] if dataset.v3 else None
    table = parquet.read_table(dataset.rows_file(episode), columns=["timestamp", *dataset.states], filters=filters)
    parts = []
    for key in dataset.states:
        part = numpy.array(table[key].to_pylist(), numpy.float64)
        part = part.reshape(len(part), -1)
        if part.shape[1] != int(dataset.features[key]["shape"][0]):
            raise ValueError(f"{key} has {part.shape[1]} values a row; meta/info.json says otherwise")
        parts.append(part)
    stamps = numpy.array(table["timestamp"].to_pylist(), numpy.float64).reshape(-1)
    values = numpy.concatenate(parts, axis=1)
    if values.size > MOST_VALUES:
        raise ValueError("too many rows for one episode")
    return stamps, values


def frames_of_video(dataset, episode, key):
    """(time in the episode in s, width, height, RGB bytes) of each picture of a video."""
    import av  # pylint: disable=import-outside-toplevel
    file, begin, end = dataset.video(episode, key)
    half = 0.5 / dataset.fps
    with av.open(str(file)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        if begin > 0.0:
            container.seek(int(begin / stream.time_base), stream=stream)
        for count, frame in enumerate(container.decode(stream)):
            time = float(frame.time) if frame.time is not None else count / dataset.fps
            if time < begin - half:
                continue
            if time >= end - half:
                return
            yield max(time - begin, 0.0), frame.width, frame.height, frame.to_ndarray(format="rgb24").tobytes()


def frames_of_images(dataset, episode, key):
    """(time in the episode in s, 0, 0, file) of pictures that stand among the readings."""
    from pyarrow import parquet  # pylint: disable=import-outside-toplevel
    filters = [("episode_index", "=", episode)] if dataset.v3 else None
    table = parquet.read_table(dataset.rows_file(episode), columns=["timestamp", key], filters=filters)
    for row in table.to_pylist():
        stored = row[key] or {}
        content = stored.get("bytes")
        if content is None and stored.get("path"):
            name = pathlib.PurePosixPath(stored["path"])
            if name.is_absolute() or ".." in name.parts:
                raise ValueError(f"{key}: path '{name}' leads out of the data set")
            content = (dataset.folder / name).read_bytes()
        if content:
            yield float(row["timestamp"]), 0, 0, content


def guarded(records, dataset, episode, key):
    """The pictures of one camera; one that breaks off says so and ends."""
    frames = frames_of_video if dataset.cameras[key]["dtype"] == "video" else frames_of_images
    try:
        for time, width, height, data in frames(dataset, episode, key):
            yield time, key, width, height, data
    except Exception as error:  # pylint: disable=broad-except
        records.write("broken", camera=key, message=" ".join(str(error).split())[:300] or type(error).__name__)


def read_episode(records, dataset, episode, cameras):
    try:
        file = dataset.rows_file(episode)
        if not file.is_file():
            raise ValueError(f"no {file.relative_to(dataset.folder)}")
        for key in cameras:
            if dataset.cameras[key]["dtype"] == "video" and not dataset.video(episode, key)[0].is_file():
                raise ValueError(f"no {dataset.video(episode, key)[0].relative_to(dataset.folder)}")
        stamps, values = read_rows(dataset, episode)
    except Exception as error:  # pylint: disable=broad-except
        why = f"'{error.args[0]}' is missing" if isinstance(error, KeyError) else " ".join(str(error).split())
        records.write("absent", episode=episode, message=why[:300])
        return
    records.write("episode", stamps.astype("<f8").tobytes() + values.astype("<f8").tobytes(), episode=episode,
                  rows=len(stamps), columns=values.shape[1])
    streams = [guarded(records, dataset, episode, key) for key in cameras]
    for time, key, width, height, data in heapq.merge(*streams, key=lambda frame: frame[:2]):
        records.write("frame" if width else "compressed", data, camera=key, time_us=round(1e6 * time), width=width,
                      height=height)
    records.write("episode_end")


def main(records):
    dataset = DataSet(sys.argv[1])
    if sys.argv[2] == "list":
        records.write("dataset", version=dataset.version, episodes=dataset.total, present=dataset.present(),
                      columns=[name for _, _, name in dataset.columns()], cameras=list(dataset.cameras))
        return
    wanted = json.loads(sys.argv[3])
    for episode in wanted["episodes"]:
        if dataset.v3 and episode not in dataset.episodes:
            records.write("absent", episode=episode, message="not in meta/episodes")
            continue
        read_episode(records, dataset, episode, wanted["cameras"])


if __name__ == "__main__":
    framing.run(main)
