/** The kinds of messages that the page understands, and the part of the state that each fills. */

import { placesInQuestion } from "../robot/places";
import type { RobotState } from "../robot/robot_state";
import type {
  Bumpers, CloudPoints, ControlState, DriveLimits, DriveTrouble, GridMap, GuardZone, HintVerdict, LocalizationStatus, MapInfo, Pose,
} from "../values";
import type { CameraPictures } from "./camera_pictures";
import type { Kind } from "./message_intake";
import { readLeanCloud } from "./message_checks/lean_cloud";
import { readPointCloud2 } from "./message_checks/point_cloud2";
import {
  type Estimate, type Inertial, type Odometry, readEstimate, readInertial, readOdometry, readPoses, readTransforms,
  type Transform,
} from "./message_checks/pose_messages";
import {
  readBumpers, readControl, readDescription, readDriveLimits, readDriveTrouble, readGuard, readMapInfo, readStatus, readVerdict, readVideoSources,
} from "./message_checks/robot_messages";
import { readCompressedImage, readJoints, readLaserScan, readOccupancyGrid } from "./message_checks/sensor_messages";
import type { RobotPicture } from "./robot_picture";

export interface MessageKinds {
  readonly transforms: Kind<readonly Transform[]>;
  readonly fixedTransforms: Kind<readonly Transform[]>;
  readonly estimate: Kind<Estimate>;
  readonly odometry: Kind<Odometry>;
  readonly truth: Kind<Odometry>;
  readonly inertial: Kind<Inertial>;
  readonly cloud: Kind<CloudPoints>;
  readonly leanCloud: Kind<CloudPoints>;
  readonly scan: Kind<CloudPoints>;
  readonly grid: Kind<GridMap>;
  readonly image: Kind<{ readonly type: string; readonly data: Uint8Array }>;
  readonly status: Kind<LocalizationStatus>;
  readonly verdict: Kind<HintVerdict>;
  readonly candidates: Kind<readonly Pose[]>;
  readonly control: Kind<ControlState>;
  readonly guard: Kind<GuardZone | undefined>;
  readonly bumpers: Kind<Omit<Bumpers, "receivedAt">>;
  readonly driveTrouble: Kind<DriveTrouble | undefined>;
  readonly mapInfo: Kind<MapInfo>;
  readonly description: Kind<string>;
  readonly driveLimits: Kind<DriveLimits>;
  readonly videoSources: Kind<ReadonlyMap<string, string>>;
  readonly joints: Kind<ReadonlyMap<string, number>>;
}

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

export function messageKinds({ state, picture, pictures, mapInfo, control, complain }: KindParts): MessageKinds {
  const cloud = (points: CloudPoints): void => {
    picture.cloud(points);
  };
  return {
    transforms: {
      // Their stamps are of several programs, some of which date them ahead: no clock is judged by them.
      read: readTransforms,
      use: (transforms, now) => {
        picture.transforms(transforms, false, now);
      },
    },
    fixedTransforms: {
      read: readTransforms,
      use: (transforms, now) => {
        picture.transforms(transforms, true, now);
      },
    },
    estimate: {
      read: readEstimate,
      stampOf: ({ pose }) => pose.stamp,
      use: (estimate) => {
        picture.estimate(estimate);
      },
    },
    odometry: {
      read: readOdometry,
      stampOf: ({ pose }) => pose.stamp,
      use: (odometry) => {
        picture.odometry(odometry);
      },
    },
    truth: {
      read: readOdometry,
      use: ({ pose }) => {
        state.truth.value = pose;
      },
    },
    inertial: {
      read: readInertial,
      stampOf: ({ stamp }) => stamp,
      use: (inertial, now, topic) => {
        picture.inertial(inertial, topic, now);
      },
    },
    cloud: { read: readPointCloud2, stampOf: ({ stamp }) => stamp, use: cloud },
    leanCloud: { read: readLeanCloud, stampOf: ({ stamp }) => stamp, use: cloud },
    scan: {
      read: readLaserScan,
      stampOf: ({ stamp }) => stamp,
      use: (scan, _now, topic) => {
        if (!picture.scan(scan)) {
          complain(topic, `no transform says where ${scan.frame} is; it is drawn about the robot's middle`);
        }
      },
    },
    grid: {
      read: readOccupancyGrid,
      use: (grid) => {
        state.gridMap.value = grid;
      },
    },
    image: {
      read: readCompressedImage,
      use: ({ type, data }, now, topic) => {
        state.image.value = pictures.show(topic, type, data, now);
      },
    },
    status: {
      read: readStatus,
      stampOf: ({ stamp }) => stamp,
      use: (status) => {
        state.status.value = status;
      },
    },
    verdict: {
      read: readVerdict,
      use: (verdict) => {
        state.verdict.value = verdict;
      },
    },
    candidates: {
      read: readPoses,
      use: (poses) => {
        // Ten times a second there are none: readers need not run for that.
        if (poses.length > 0 || state.candidates.peek().length > 0) {
          const [scores, places] = [state.status.peek()?.candidateScores ?? [], state.mapInfo.peek()?.places ?? []];
          state.candidates.value = placesInQuestion(poses, scores, places, state.mapFromBase.peek());
        }
      },
    },
    control: {
      read: readControl,
      stampOf: ({ stamp }) => stamp,
      use: (value, now) => {
        control();
        state.control.value = value;
        state.controlAt.value = now;
      },
    },
    guard: {
      read: readGuard,
      use: (zone) => {
        state.guard.value = zone;
      },
    },
    bumpers: {
      read: readBumpers,
      use: (bumpers, now) => {
        // The last press is kept: whoever looks a second later is to see it.
        if ([...bumpers.front, ...bumpers.rear].includes(true)) {
          state.bumpers.value = { ...bumpers, receivedAt: now };
        }
      },
    },
    driveTrouble: {
      read: readDriveTrouble,
      use: (trouble) => {
        state.driveTrouble.value = trouble ?? state.driveTrouble.peek();
      },
    },
    mapInfo: { read: readMapInfo, use: mapInfo },
    videoSources: {
      read: readVideoSources,
      use: (sources) => {
        state.videoSources.value = sources;
      },
    },
    joints: {
      read: readJoints,
      use: (joints) => {
        state.joints.value = joints;
      },
    },
    driveLimits: {
      read: readDriveLimits,
      use: (limits) => {
        state.driveLimits.value = limits;
      },
    },
    description: {
      read: readDescription,
      use: (description) => {
        state.description.value = description;
      },
    },
  };
}
