MODULE m
  RECORD dip
    robtarget at;
    num depth;
  ENDRECORD
  RECORD station
    dip first;
    pose shift;
  ENDRECORD
  RECORD lookalike
    pos a;
    orient b;
    confdata c;
    extjoint d;
  ENDRECORD
  ALIAS robtarget place;
  CONST num nTwo:=2;
  CONST dip dOne:=[[[1,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],5];
  PERS station stAll{2}:=[[[[[2,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],5],[[0,0,0],[1,0,0,0]]],[[[[3,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],5],[[0,0,0],[1,0,0,0]]]];
  CONST robtarget pGrid{2,2}:=[[[[4,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[5,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]],[[[6,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],[[7,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]]];
  CONST place plOne:=[[8,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  CONST lookalike laOne:=[[9,9,9],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  PERS num nTable{4,4}:=[[1,2,3,4],[1,0,0,0],[0,0,0,0],[0,0,0,0]];
  PROC main()
    MoveL dOne.at,v100,z10,tGun\WObj:=wTable;
    MoveL stAll{nTwo}.first.at,v100,z10,tGun\WObj:=wTable;
    MoveL pGrid{2,1},v100,z10,tGun\WObj:=wTable;
    MoveL plOne,v100,z10,tGun\WObj:=wTable;
    FOR i FROM 1 TO 2 DO
      MoveL stAll{i}.first.at,v100,z10,tGun\WObj:=wTable;
    ENDFOR
  ENDPROC
ENDMODULE
