import type {Writable} from './writable';

/** @deprecated @see Writable */
export type Mutable<BaseType, Keys extends keyof BaseType = keyof BaseType> =
	Writable<BaseType, Keys>;
