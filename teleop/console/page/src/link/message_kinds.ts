/** The kinds of messages that the page understands, and the part of the state that each fills. */

import type { Signal } from "@preact/signals";
import { placesInQuestion } from "../robot/places";
import type { RobotState } from "../robot/robot_state";
import type { CloudPoints, MapInfo } from "../values";
import type { CameraPictures } from "./camera_pictures";
import type { Kind } from "./message_intake";
import { readLeanCloud } from "./message_checks/lean_cloud";
import { readPointCloud2 } from "./message_checks/point_cloud2";
import { readEstimate, readInertial, readOdometry, readPoses, readTransforms } from "./message_checks/pose_messages";
import {
  readBumpers, readControl, readDescription, readDriveLimits, readDriveTrouble, readGuard, readMapInfo, readStatus, readVerdict, readVideoSources,
} from "./message_checks/robot_messages";
import { readCompressedImage, readJoints, readLaserScan, readOccupancyGrid } from "./message_checks/sensor_messages";
import type { RobotPicture } from "./robot_picture";

/** What the kinds need besides the state. */
export interface KindParts {
  readonly state: RobotState;
  readonly picture: RobotPicture;
  readonly pictures: CameraPictures;
  readonly mapInfo: (info: MapInfo) => void;
  /** Called with each state of the robot's control, which only our robot sends. */
  readonly control: () => void;
  readonly complain: (topic: string, complaint: string) => void;
}

/** The kinds, by names of their own: several topics may be of one. */
export type MessageKinds = ReturnType<typeof messageKinds>;

function kind<T>(read: Kind<T>["read"], use: Kind<T>["use"], stampOf?: (value: T) => number): Kind<unknown> {
  const found: Kind<T> = stampOf === undefined ? { read, use } : { read, use, stampOf };
  return found;
}

/** Return what keeps each message as a part of the state. */
function keptIn<T>(part: Signal<T>): (value: T) => void {
  return (value) => { part.value = value; };
}

export function messageKinds({ state, picture, pictures, mapInfo, control, complain }: KindParts) {
  const stamp = (dated: { readonly stamp: number }): number => dated.stamp;
  const stampOfPose = ({ pose }: { readonly pose: { readonly stamp: number } }): number => pose.stamp;
  const cloud = (points: CloudPoints): void => { picture.cloud(points); };
  return {
    // Their stamps are of several programs, some of which date them ahead: no clock is judged by them.
    transforms: kind(readTransforms, (transforms, now) => { picture.transforms(transforms, false, now); }),
    fixedTransforms: kind(readTransforms, (transforms, now) => { picture.transforms(transforms, true, now); }),
    estimate: kind(readEstimate, (estimate) => { picture.estimate(estimate); }, stampOfPose),
    odometry: kind(readOdometry, (odometry) => { picture.odometry(odometry); }, stampOfPose),
    truth: kind(readOdometry, ({ pose }) => { state.truth.value = pose; }),
    inertial: kind(readInertial, (inertial, now, topic) => { picture.inertial(inertial, topic, now); }, stamp),
    cloud: kind(readPointCloud2, cloud, stamp),
    leanCloud: kind(readLeanCloud, cloud, stamp),
    scan: kind(readLaserScan, (scan, _now, topic) => {
      if (!picture.scan(scan)) {
        complain(topic, `no transform says where ${scan.frame} is; it is drawn about the robot's middle`);
      }
    }, stamp),
    grid: kind(readOccupancyGrid, keptIn(state.gridMap)),
    image: kind(readCompressedImage, ({ type, data }, now, topic) => { state.image.value = pictures.show(topic, type, data, now); }),
    status: kind(readStatus, (status) => { state.status.value = status; }, stamp),
    verdict: kind(readVerdict, keptIn(state.verdict)),
    candidates: kind(readPoses, (poses) => {
      // Ten times a second there are none: readers need not run for that.
      if (poses.length > 0 || state.candidates.peek().length > 0) {
        const [scores, places] = [state.status.peek()?.candidateScores ?? [], state.mapInfo.peek()?.places ?? []];
        state.candidates.value = placesInQuestion(poses, scores, places, state.mapFromBase.peek());
      }
    }),
    control: kind(readControl, (value, now) => {
      control();
      state.control.value = value;
      state.controlAt.value = now;
    }, stamp),
    guard: kind(readGuard, keptIn(state.guard)),
    bumpers: kind(readBumpers, (bumpers, now) => {
      // The last press is kept: whoever looks a second later is to see it.
      if ([...bumpers.front, ...bumpers.rear].includes(true)) {
        state.bumpers.value = { ...bumpers, receivedAt: now };
      }
    }),
    driveTrouble: kind(readDriveTrouble, (trouble) => { state.driveTrouble.value = trouble ?? state.driveTrouble.peek(); }),
    mapInfo: kind(readMapInfo, mapInfo),
    videoSources: kind(readVideoSources, keptIn(state.videoSources)),
    joints: kind(readJoints, keptIn(state.joints)),
    driveLimits: kind(readDriveLimits, keptIn(state.driveLimits)),
    description: kind(readDescription, keptIn(state.description)),
  };
}
