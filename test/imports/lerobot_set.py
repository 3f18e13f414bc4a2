"""Writes a small LeRobot data set by the published layout, for tests: episodes 0, 1 and 3 of 4, 20 rows each.

usage: lerobot_set.py FOLDER version=2.1|3.0 [short_video=FRAMES] [width=PX] [images=1] [nan=1]
v2.1: a parquet file and a video for each episode. v3.0: all episodes in one parquet file and one video, and
meta/episodes says which part is whose. images=1: pictures as PNG files in the parquet file instead of videos.
"""
import fractions
import io
import json
import math
import pathlib
import sys

import av
import numpy as np
import pyarrow as pa
from pyarrow import parquet

FPS, ROWS, EPISODES, TOTAL = 30, 20, (0, 1, 3), 4
KEY = "observation.images.side"
NAMES = ["gripper", *(f"axis{j}" for j in range(7, 0, -1))]


def state(episode, row):
    return [0.5, *(10.0 * j + 5.0 * episode + 0.5 * row for j in range(7, 0, -1))]


def picture(episode, row, width, height=48):
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[..., 0] = 20 * episode + 20
    pixels[:, : 2 + 2 * row] = 200
    return pixels


def write_video(path, pictures):
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libsvtav1" if "libsvtav1" in av.codecs_available else "mpeg4", rate=FPS)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.pix_fmt = "yuv420p"
        for pixels in pictures:
            for packet in stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


def png(pixels):
    codec = av.CodecContext.create("png", "w")
    codec.height, codec.width = pixels.shape[:2]
    codec.pix_fmt = "rgb24"
    codec.time_base = fractions.Fraction(1, FPS)
    out = io.BytesIO()
    for packet in [*codec.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")), *codec.encode(None)]:
        out.write(bytes(packet))
    return out.getvalue()


def table_of(episodes, keys):
    rows = [(episode, row) for episode in episodes for row in range(ROWS)]
    values = [state(episode, row) for episode, row in rows]
    if keys.get("nan"):
        values[3][0] = values[3][1] = math.nan  # of the gripper, which is left out, and of a joint
    columns = {
        "observation.state": pa.array(values, pa.list_(pa.float32(), len(NAMES))),
        "action": pa.array(values, pa.list_(pa.float32(), len(NAMES))),
        "timestamp": pa.array([row / FPS for _, row in rows], pa.float32()),
        "frame_index": pa.array([row for _, row in rows], pa.int64()),
        "episode_index": pa.array([episode for episode, _ in rows], pa.int64()),
        "index": pa.array(list(range(len(rows))), pa.int64()),
        "task_index": pa.array([0] * len(rows), pa.int64()),
    }
    if keys.get("images"):
        columns[KEY] = pa.array([{"bytes": png(picture(episode, row, 64)), "path": None} for episode, row in rows],
                                pa.struct([("bytes", pa.binary()), ("path", pa.string())]))
    return pa.table(columns)


def write_table(path, table):
    path.parent.mkdir(parents=True, exist_ok=True)
    parquet.write_table(table, path)


def info(keys):
    v3 = keys["version"] == "3.0"
    width = int(keys.get("width", 64))
    vector = {"dtype": "float32", "shape": [len(NAMES)], "names": NAMES if v3 else [NAMES]}
    paths = {"data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
             "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"} if v3 else {
        "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "video_path": "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4"}
    scalar = {"dtype": "float32", "shape": [1], "names": None}
    return {"codebase_version": "v" + keys["version"], "robot_type": "arm7", "total_episodes": TOTAL,
            "total_frames": TOTAL * ROWS, "chunks_size": 1000, "fps": FPS, "splits": {"train": f"0:{TOTAL}"}, **paths,
            "features": {"observation.state": vector, "action": vector, "timestamp": scalar,
                         KEY: {"dtype": "image" if keys.get("images") else "video", "shape": [48, width, 3],
                               "names": ["height", "width", "channels"]}}}


def write_v2(folder, keys, frames):
    for episode in EPISODES:
        write_table(folder / f"data/chunk-000/episode_{episode:06d}.parquet", table_of([episode], keys))
        if not keys.get("images"):
            write_video(folder / f"videos/chunk-000/{KEY}/episode_{episode:06d}.mp4",
                        frames[episode][:int(keys.get("short_video", ROWS))])


def write_v3(folder, keys, frames):
    write_table(folder / "data/chunk-000/file-000.parquet", table_of(EPISODES, keys))
    write_video(folder / f"videos/{KEY}/chunk-000/file-000.mp4", [f for episode in EPISODES for f in frames[episode]])
    rows = []
    for place, episode in enumerate(EPISODES):
        rows.append({"episode_index": episode, "tasks": ["wave"], "length": ROWS,
                     "data/chunk_index": 0, "data/file_index": 0,
                     "dataset_from_index": place * ROWS, "dataset_to_index": (place + 1) * ROWS,
                     f"videos/{KEY}/chunk_index": 0, f"videos/{KEY}/file_index": 0,
                     f"videos/{KEY}/from_timestamp": place * ROWS / FPS,
                     f"videos/{KEY}/to_timestamp": (place + 1) * ROWS / FPS,
                     "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0})
    write_table(folder / "meta/episodes/chunk-000/file-000.parquet", pa.Table.from_pylist(rows))


def main():
    folder = pathlib.Path(sys.argv[1])
    keys = dict(argument.split("=", 1) for argument in sys.argv[2:])
    (folder / "meta").mkdir(parents=True)
    (folder / "meta/info.json").write_text(json.dumps(info(keys)), encoding="utf-8")
    width = int(keys.get("width", 64))
    frames = {episode: [picture(episode, row, width) for row in range(ROWS)] for episode in EPISODES}
    (write_v3 if keys["version"] == "3.0" else write_v2)(folder, keys, frames)


if __name__ == "__main__":
    main()
